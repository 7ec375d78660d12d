// Explorers that pages compute without Python, for display.js. Functions have the names of their twins in Python.
// show(values) returns the points of each artist in the coordinates of its axes, and the displayed texts.
rbcourseDisplay.computed = (() => {
  const { sin, cos, atan2, hypot, sqrt, max, abs, PI } = Math, radians = (x) => x * (PI / 180), degrees = (x) => x * (180 / PI);
  const range = (n) => Array.from({ length: n }, (_, k) => k);

  // Return numbers as text, separated by commas; halves are rounded to even, and zero has no minus sign.
  const numbers = (values, digits) => values.map((x) => {
    const scaled = x * 10 ** digits, down = Math.floor(scaled);
    const whole = scaled - down === 0.5 ? down + (abs(down) % 2) : Math.round(scaled);
    return (whole / 10 ** digits + 0).toFixed(digits).replace("-", "−");
  }).join(", ");

  const math = {
    // The joints of an arm: base, elbow and tip.
    arm_forward_kinematics: ([q0, q1], [a, b]) => {
      const elbow = [a * cos(q0), a * sin(q0)];
      return [[0, 0], elbow, [elbow[0] + b * cos(q0 + q1), elbow[1] + b * sin(q0 + q1)]];
    },
    // Both pairs of angles for a tip, the first with the elbow at a positive angle; null out of reach.
    arm_inverse_kinematics: ([x, y], [a, b]) => {
      const r = hypot(x, y), slack = 9e-16 * (a + b);
      if (r > a + b + slack || r < abs(a - b) - slack) return null;
      const half = atan2(sqrt(max(0, (a + b - r) * (a + b + r))), sqrt(max(0, (r - abs(a - b)) * (r + abs(a - b)))));
      return [2 * half, -2 * half].map((elbow) => {
        const shoulder = atan2(y, x) - atan2(b * sin(elbow), a + b * cos(elbow));
        return [shoulder - 2 * PI * Math.round(shoulder / (2 * PI)), elbow];
      });
    },
    // The position of the projected line on the geodesic, its rate, and the singular value of the line.
    theta: (t, a) => 0.5 + Math.atan((2 * t - 1) * Math.tan(a / 2)) / a,
    singular_value: (t, a) => hypot(cos(a / 2), (2 * t - 1) * sin(a / 2)),
    theta_rate: (t, a) => sin(a) / a / math.singular_value(t, a) ** 2,
    matmul: (A, B) => A.map((row) => B[0].map((_, j) => row.reduce((sum, x, k) => sum + x * B[k][j], 0))),
    transpose: (A) => A[0].map((_, j) => A.map((row) => row[j])),
    // The eigenvalues of a symmetric matrix and, as columns, its eigenvectors, by Jacobi's rotations.
    eigh(S) {
      let V = S.map((row, i) => row.map((_, j) => +(i === j)));
      for (let sweep = 0; sweep < 12; sweep++) for (let p = 0; p < S.length; p++) for (let q = p + 1; q < S.length; q++) {
        const a = 0.5 * atan2(2 * S[p][q], S[q][q] - S[p][p]), J = S.map((row, i) => row.map((_, j) => +(i === j)));
        Object.assign(J[p], { [p]: cos(a), [q]: sin(a) });
        Object.assign(J[q], { [p]: -sin(a), [q]: cos(a) });
        [S, V] = [math.matmul(math.transpose(J), math.matmul(S, J)), math.matmul(V, J)];
      }
      return [S.map((row, i) => row[i]), V];
    },
    matrix_from_quaternion: ([w, x, y, z]) => [
      [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
      [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
      [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]],
    // The nearest rotation: its quaternion is the eigenvector of the largest eigenvalue of a 4 × 4 matrix.
    project_so(M) {
      const [[a, b, c], [d, e, f], [g, h, i]] = M;
      const [values, vectors] = math.eigh([[a + e + i, h - f, c - g, d - b], [h - f, a - e - i, b + d, c + g],
        [c - g, b + d, e - a - i, f + h], [d - b, c + g, f + h, i - a - e]]);
      const most = values.indexOf(Math.max(...values));
      return math.matrix_from_quaternion(vectors.map((row) => row[most]));
    },
    // Gram and Schmidt's columns, or null if the columns depend on each other.
    orthonormalize_gram_schmidt(M) {
      const columns = [];
      for (let q of math.transpose(M)) {
        const size = hypot(...q);
        for (const p of [...columns, ...columns]) {
          const along = q.reduce((sum, x, k) => sum + x * p[k], 0);
          q = q.map((x, k) => x - along * p[k]);
        }
        if (hypot(...q) <= 2.7e-15 * size) return null;
        columns.push(q.map((x) => x / hypot(...q)));
      }
      return math.transpose(columns);
    },
    det: ([[a, b, c], [d, e, f], [g, h, i]]) => a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g),
    angle_between(R, S) {
      const [[a, b, c], [d, e, f], [g, h, i]] = math.matmul(math.transpose(R), S);
      return atan2(hypot(h - f, c - g, d - b) / 2, (a + e + i - 1) / 2);
    },
  };

  const links = [2, 1.5], start = [-20, 110].map(radians);
  const beside = ([x, y], dx, dy) => [x + 0.5 * dx, y + 0.3 * dy];
  const arm = {
    title: "The arm",
    show([theta0, theta1, t]) {
      const joints = (share) => math.arm_forward_kinematics(start.map((x, k) => x + share * (radians([theta0, theta1][k]) - x)), links);
      const now = joints(t), [, elbow, end] = joints(1), q = start.map((x, k) => x + t * (radians([theta0, theta1][k]) - x));
      return {
        points: {
          way: range(61).map((k) => joints((t * k) / 60)[2]),
          goal: [end],
          "goal name": [beside(end, end[1] - elbow[1], elbow[0] - end[0])],
          links: now,
          "hand name": [beside(now[2], now[2][0] - now[1][0], now[2][1] - now[1][1])],
        },
        said: [["angles", `(${numbers(q.map(degrees), 1)})°`], ["hand", `(${numbers(now[2], 2)}) m`]],
      };
    },
    // A goal moves the arm to it. A click or a drag sets the goal; the elbow stays on its side.
    moved: (values, k) => (k < 2 ? [values[0], values[1], 1] : values),
    point(place, [, theta1]) {
      const found = math.arm_inverse_kinematics(place, links);
      return found && [...found[theta1 >= 0 ? 0 : 1].map(degrees), 1];
    },
  };

  const theta = {
    title: "The line and its shadow",
    show([angle, t]) {
      const a = radians(angle), on = (share) => [cos(PI / 2 + a / 2 - a * share), sin(PI / 2 + a / 2 - a * share)];
      const now = math.theta(t, a), [first, last] = [on(0), on(1)], times = range(101).map((k) => k / 100);
      return {
        points: {
          arc: times.map(on),
          chord: [first, last],
          ray: [[0, 0], on(now)],
          even: [on(t)],
          line: [first.map((x, k) => x + t * (last[k] - x))],
          "line name": [[last[0] + 0.06, last[1] - 0.04]],
          shadow: [on(now)],
          theta: times.map((time) => [time, math.theta(time, a)]),
          "theta now": [[t, now]],
        },
        said: [["θ(t)", now], ["dθ/dt", math.theta_rate(t, a)], ["s(t), of the line", math.singular_value(t, a)]].map(
          ([name, value]) => [name, value.toFixed(3)]),
      };
    },
  };
  const projection = {
    title: "Two repairs",
    show([e12, e23, e33, pull]) {
      const M = [[1, pull * e12, 0], [0, 1, pull * e23], [0, 0, 1 + pull * e33]];
      const R = math.project_so(M), G = math.orthonormalize_gram_schmidt(M), det = math.det(M), points = {};
      const flat = [[0, 0, 0], [0, 0, 0], [0, 0, 0]], fate = !G ? "none: M is flat" : math.det(G) > 0 ? "" : "a mirror";
      for (const [name, matrix] of [["M", M], ["nearest", R], ["Gram–Schmidt", G ?? flat]]) {
        math.transpose(matrix).forEach((column, k) => {
          points[`${name} ${"xyz"[k]}`] = [[0, 0, 0], column];
          points[`${name} ${"xyz"[k]} letter`] = [column.map((x) => 1.2 * x)];
        });
      }
      const singular = math.eigh(math.matmul(math.transpose(R), M))[0].map(abs).sort((a, b) => b - a);
      const far = (S) => hypot(...M.flatMap((row, i) => row.map((x, j) => x - S[i][j])));
      const said = [
        ["determinant", numbers([det], 2)],
        ["singular values", numbers(singular, 2)],
        ["M to nearest", numbers([far(R)], 3)],
        ["M to Gram–Schmidt", fate || numbers([far(G)], 3)],
        ["angle between", fate ? "none" : `${numbers([degrees(math.angle_between(R, G))], 1)}°`],
      ];
      if (singular[1] + Math.sign(det) * singular[2] < 1e-9) said.push(["nearest?", "several are equally near"]);
      return { points, said };
    },
  };
  // Return an explorer for display.js. A part has the map from its axes to pixels; a name moves from its anchor.
  const placed = ({ title, show, moved, point }) => (parts, drawings) => ({
    state(values) {
      const { points, said } = show(values);
      const all = parts.flatMap(({ name, axes, anchor }, i) => {
        if (!name) return drawings[i]; // these artists do not move
        const places = points[name].map((place) => place.map((x, k) => axes[2 * k] * x + axes[2 * k + 1]));
        const [right, down] = anchor ? places[0].map((x, k) => Math.round(x) - anchor[k]) : [];
        const run = (old) => (anchor ? old.map(([x, y]) => [x + right, y + down]) : places);
        return drawings[i].map(({ style, runs }) => ({ style, runs: runs.map(run) }));
      });
      return [all, [said, "", `${title}. ${said.map((pair) => pair.join(": ")).join("; ")}`]];
    },
    moved,
    point: point && (([x, y], values) => {
      const [sx, x0, sy, y0] = parts.at(-1).axes;
      return point([(x - x0) / sx, (y - y0) / sy], values);
    }),
  });
  const all = { arm, theta, projection };
  for (const [name, explorer] of Object.entries(all)) rbcourseDisplay.explorers[name] = placed(explorer);
  return { math, ...all };
})();
