// Explorers that pages compute without Python, for display.js. Functions have the names of their twins in Python.
// show(values) returns the points of each artist in the coordinates of its axes, and the displayed texts.
rbcourseDisplay.computed = (() => {
  const { sin, cos, atan2, hypot, sqrt, max, abs, PI } = Math, radians = (x) => x * (PI / 180), degrees = (x) => x * (180 / PI);
  const range = (n) => Array.from({ length: n }, (_, k) => k), unit = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  const dot = (p, q) => p.reduce((sum, x, k) => sum + x * q[k], 0), plus = (p, q) => p.map((x, k) => x + q[k]);
  const scaled = (factor, p) => p.map((x) => factor * x), mean = (some) => scaled(1 / some.length, some.reduce(plus));
  const minus = (p, q) => plus(p, scaled(-1, q)), between = (p, q, share) => plus(p, scaled(share, minus(q, p)));
  const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];

  // Return numbers as text, separated by commas; halves are rounded to even, and zero has no minus sign.
  const numbers = (values, digits) => values.map((x) => {
    const large = x * 10 ** digits, down = Math.floor(large);
    const whole = large - down === 0.5 ? down + (abs(down) % 2) : Math.round(large);
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
    // The quaternion of a rotation, or of the nearest one: the eigenvector of the largest eigenvalue of a 4 × 4 matrix.
    quaternion_from_matrix(M) {
      const [[a, b, c], [d, e, f], [g, h, i]] = M;
      const [values, vectors] = math.eigh([[a + e + i, h - f, c - g, d - b], [h - f, a - e - i, b + d, c + g],
        [c - g, b + d, e - a - i, f + h], [d - b, c + g, f + h, i - a - e]]);
      const q = vectors.map((row) => row[values.indexOf(Math.max(...values))]);
      const most = Math.max(...q.map(abs)), large = q.find((x) => abs(x) > most - 1e-8); // decides for half-turns
      return scaled(Math.sign(abs(q[0]) > 1e-15 ? q[0] : large), q);
    },
    project_so: (M) => math.matrix_from_quaternion(math.quaternion_from_matrix(M)),
    log_so3(R) {
      const [w, ...v] = math.quaternion_from_matrix(R), size = hypot(...v);
      return scaled(size > 1e-15 ? (2 * atan2(size, w)) / size : 0, v);
    },
    exp_so3(w) {
      const angle = hypot(...w);
      return math.matrix_from_quaternion([cos(angle / 2), ...scaled(angle ? sin(angle / 2) / angle : 0, w)]);
    },
    matrix_from_zyx: (angles) => angles.map((angle, k) => math.exp_so3(scaled(angle, unit[2 - k]))).reduce(math.matmul),
    quaternion_from_zyx(angles) {
      const [[a, b, c], [d, e, f]] = [cos, sin].map((part) => angles.map((x) => part(x / 2)));
      return [a * b * c + d * e * f, a * b * f - d * e * c, a * e * c + d * b * f, d * b * c - a * e * f];
    },
    // The quaternion at a share of the short arc between two unit quaternions.
    slerp(p, q, t) {
      const near = scaled(dot(p, q) < -9e-16 ? -1 : 1, q), angle = atan2(hypot(...minus(near, p)), hypot(...plus(near, p)));
      if (angle < 1e-9) return p;
      return plus(scaled(sin(2 * (1 - t) * angle) / sin(2 * angle), p), scaled(sin(2 * t * angle) / sin(2 * angle), near));
    },
    // The pose in the plane after a motion with the velocities (vx, vy, vθ) in the frame of the body.
    exp_planar([x, y, angle]) {
      const s = angle ? sin(angle) / angle : 1, c = angle ? (1 - cos(angle)) / angle : 0;
      return [s * x - c * y, c * x + s * y, angle];
    },
    compose_planar: ([x, y, angle], [u, v, more]) => [
      x + cos(angle) * u - sin(angle) * v, y + sin(angle) * u + cos(angle) * v, angle + more],
    // The axis of the screw from the origin to a pose, its point nearest to the origin, and its slide.
    screw_from_pose(w, place) {
      const angle = hypot(...w), size = angle || hypot(...place) || 1, axis = scaled(1 / size, angle ? w : place);
      const slide = dot(axis, place), off = plus(place, scaled(-slide, axis));
      const point = angle ? scaled(0.5, plus(off, scaled(1 / Math.tan(angle / 2), cross(axis, off)))) : [0, 0, 0];
      return { axis, point, slide };
    },
    // Gram and Schmidt's columns, or null if the columns depend on each other.
    orthonormalize_gram_schmidt(M) {
      const columns = [];
      for (let q of math.transpose(M)) {
        const size = hypot(...q);
        for (const p of [...columns, ...columns]) q = minus(q, scaled(dot(q, p), p));
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
      const q = (share) => between(start, [theta0, theta1].map(radians), share);
      const joints = (share) => math.arm_forward_kinematics(q(share), links), now = joints(t), [, elbow, end] = joints(1);
      return {
        points: {
          way: range(61).map((k) => joints((t * k) / 60)[2]),
          goal: [end],
          "goal name": [beside(end, end[1] - elbow[1], elbow[0] - end[0])],
          links: now,
          "hand name": hypot(...minus(end, now[2])) > 0.5 ? [beside(now[2], now[2][0] - now[1][0], now[2][1] - now[1][1])] : [],
        },
        said: [["angles", `(${numbers(q(t).map(degrees), 1)})°`], ["hand", `(${numbers(now[2], 2)}) m`]],
      };
    },
    // A goal moves the arm to it. A click or a drag sets the goal; the elbow stays on its side.
    moved: (values, k) => (k < 2 ? [values[0], values[1], 1] : values),
    on: "links",
    point(place, [, theta1]) {
      const found = math.arm_inverse_kinematics(place, links);
      return found && [...found[theta1 >= 0 ? 0 : 1].map(degrees), 1];
    },
  };

  const theta = {
    title: "The line and its shadow",
    // A click or a drag moves the point on the line.
    on: "line",
    point: ([x], [angle]) => [angle, Math.max(0, Math.min(1, 0.5 + x / (2 * sin(radians(angle) / 2))))],
    show([angle, t]) {
      const a = radians(angle), on = (share) => [cos(PI / 2 + a / 2 - a * share), sin(PI / 2 + a / 2 - a * share)];
      const now = math.theta(t, a), [first, last] = [on(0), on(1)], times = range(101).map((k) => k / 100);
      return {
        points: {
          arc: times.map(on),
          chord: [first, last],
          ray: [[0, 0], on(now)],
          even: [on(t)],
          line: [between(first, last, t)],
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

  // The axes of a frame, and their letters.
  const lettered = (name, matrix) => Object.fromEntries(math.transpose(matrix).flatMap((column, k) => {
    const axis = `${name} ${"xyz"[k]}`;
    return [[axis, [[0, 0, 0], column]], [`${axis} letter`, [scaled(1.2, column)]]];
  }));
  const projection = {
    title: "Two repairs",
    show([e12, e23, e33, pull]) {
      const M = [[1, pull * e12, 0], [0, 1, pull * e23], [0, 0, 1 + pull * e33]];
      const R = math.project_so(M), G = math.orthonormalize_gram_schmidt(M), det = math.det(M);
      const flat = [[0, 0, 0], [0, 0, 0], [0, 0, 0]], fate = !G ? "none: M is flat" : math.det(G) > 0 ? "" : "a mirror";
      const points = { ...lettered("M", M), ...lettered("nearest", R), ...lettered("Gram–Schmidt", G ?? flat) };
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
  const plan = {
    title: "A plan of two commands",
    show([...values]) {
      const t = values.pop(), now = Math.round(20 * t), points = {}, said = [], places = [];
      const commands = [values.slice(0, 3), values.slice(3)].map(([x, y, turn]) => [x, y, radians(turn)]);
      const add = { world: plus, body: (pose, way) => math.compose_planar(pose, math.exp_planar(way)) };
      for (const [frame, after] of Object.entries(add)) {
        const half = range(41).map((k) => after([0, 0, 0], scaled(k / 20, commands[0])));
        const path = [...half, ...range(40).map((k) => after(half[40], scaled((k + 1) / 20, commands[1])))];
        const on = (x, y) => math.compose_planar(path[now], [1.3 * x, 1.3 * y, 0]).slice(0, 2);
        const plane = path.map(([x, y]) => [x, y]), [x, y] = plane[now];
        points[`${frame} plan`] = plane;
        points[`${frame} way`] = plane.slice(0, now + 1);
        points[`${frame} outline`] = [on(-0.5, -0.25), on(0.5, -0.25), on(0.5, 0.25), on(-0.5, 0.25), on(-0.5, -0.25)];
        points[`${frame} nose`] = [on(0.2, -0.25), on(0.5, 0), on(0.2, 0.25)];
        places.push([x, y]);
        said.push([frame, `(${numbers([x, y], 2)}) m, heading ${numbers([degrees(path[now][2])], 0)}°`]);
      }
      const up = places[0][1] - places[1][1] > -1e-9 ? 1.2 : -1.2; // the name of the higher body is above it
      Object.keys(add).forEach((frame, k) => {
        const [x, y] = places[k], place = [x, y + (k ? -up : up)];
        points[`${frame} name`] = [place.map((each, i) => max([-6.5, -4.5][i], Math.min([6.5, 4.5][i], each)))];
      });
      return { points, said };
    },
  };

  // The faces of a box, and a rectangle on its upper face.
  function box(edges, R, place) {
    const around = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
    const faces = range(6).map((k) => around.map(([a, b]) => {
      const corner = [0, 0, 0];
      [corner[k % 3], corner[(k + 1) % 3], corner[(k + 2) % 3]] = [k < 3 ? 1 : -1, a, b];
      return corner;
    }));
    faces.push(faces[2].map(([x, y, z]) => [x / 2, y / 2, 1.02 * z]));
    return faces.map((face) => face.map((p) => plus(place, R.map((row) => dot(row, p.map((x, k) => (x * edges[k]) / 2))))));
  }

  // Names stand beyond the ends of axes and, in the first view, beside the box.
  const LEAST = 1.05;
  function beyond(end, size) {
    const { right, up } = rbcourseScene.sight([-55, 20]);
    const seen = [dot(right, end), dot(up, end) + 1e-9], far = hypot(...seen), toward = scaled(1 / max(far, 1e-9), seen);
    const out = size.map((x, k) => x / 2 / max(abs(toward[k]), 1e-9)), half = scaled(0.5, size);
    const more = max(far + Math.min(...out), hypot(1.3, 0.8, 0.25) / 2 + dot(half, toward.map(abs))) - far;
    return plus(end, plus(scaled(more * toward[0], right), scaled(more * toward[1], up)));
  }
  const orientation = {
    title: "An orientation",
    show([alpha, beta, gamma]) {
      const angles = [alpha, beta, gamma].map(radians), R = math.matrix_from_zyx(angles), columns = math.transpose(R);
      const r = math.log_so3(R), angle = hypot(...r), axis = angle ? scaled(1 / angle, r) : r;
      const second = [-sin(angles[0]), cos(angles[0]), 0], turns = [unit[2], second, columns[0]];
      const side = Math.sign(dot(turns.reduce(plus), axis)) || 1; // not at the ends where the other names are
      const points = { box: box([1.3, 0.8, 0.25], R, [0, 0, 0]), ...lettered("body", R) };
      const named = [["first turn", turns[0], -1, 1.3, 0.65], ["second turn", second, -1, LEAST, 0.87],
        ["third turn", columns[0], -1, LEAST, 0.71], ["one axis for all", axis, side, 1.23, 1.03]];
      for (const [name, along, sign, far, wide] of named) {
        points[name] = [scaled(-sign * LEAST, along), scaled(sign * far, along)];
        points[`${name} name`] = [beyond(scaled(sign * far, along), [wide, 0.28])];
      }
      const lines = R.map((row) => row.map((x) => numbers([x], 3).padStart(6, "\u2007")).join("  ")).join("\n");
      const said = [["matrix", lines], ["quaternion", numbers(math.quaternion_from_matrix(R), 2)],
        ["axis", angle ? numbers(axis, 2) : "any"], ["angle", `${numbers([degrees(angle)], 1)}°`]];
      if (!angle) points["one axis for all name"] = [];
      if (abs(beta) === 90) {
        const both = alpha - Math.sign(beta) * gamma + 180, left = both - 360 * Math.floor(both / 360) - 180;
        said.push(["gimbal lock", `first and third axis coincide,\nα ${beta > 0 ? "−" : "+"} γ = ${numbers([left], 0)}°`]);
      }
      return { points, said };
    },
  };

  const screw = {
    title: "Geodesic and screw",
    show([angle, tilt, x, z, t]) {
      const along = [sin(radians(tilt)), 0, cos(radians(tilt))], goal = [x, 0, z], edges = [0.8, 0.8, 0.8];
      const w = scaled(radians(angle === -180 ? 180 : angle), along), { axis, point, slide } = math.screw_from_pose(w, goal);
      const turned = (share) => math.exp_so3(scaled(share, w)), R = turned(t), steps = range(101).map((k) => (t * k) / 100);
      const around = (share) => plus(scaled(share * slide, axis), minus(point, turned(share).map((row) => dot(row, point))));
      const places = { geodesic: scaled(t, goal), screw: angle ? around(t) : scaled(t, goal) };
      const points = {
        axis: [-1.8, 1.8].map((far) => plus(point, scaled(far, axis))),
        "axis name": [plus(point, scaled(axis[2] < 0 ? 2 : -2, axis))],
        "geodesic way": steps.map((share) => scaled(share, goal)),
        "screw way": steps.map((share) => (angle ? around(share) : scaled(share, goal))),
        goal: box(edges, turned(1), goal),
      };
      const up = places.geodesic[2] > places.screw[2] - 1e-9 ? 0.75 : -0.75, said = [];
      for (const [name, place] of Object.entries(places)) {
        points[name] = box(edges, R, place);
        points[`${name} name`] = [plus(place, [0, 0, name === "screw" ? -up : up])];
        said.push([`turned, ${name}`, `${numbers([t * abs(angle)], 1)}°`]);
      }
      const gap = hypot(...minus(places.screw, places.geodesic)), far = hypot(...point) > 3 ? ", not in sight" : "";
      said.push(["origins apart", `${numbers([gap], 2)} m`],
        ["its axis through", angle ? `(${numbers(point, 1)}) m${far}` : "none"],
        ["slide along it", angle ? `${numbers([slide / hypot(...w)], 2)} m per rad` : "all of the way"]);
      return { points, said };
    },
  };

  const interpolation = {
    title: "Four ways to the goal",
    show([...values]) {
      const t = values.pop(), times = range(201).map((k) => k / 200), points = {}, said = [];
      const ends = [values.slice(0, 3), values.slice(3)].map((angles) => angles.map(radians));
      const R = ends.map(math.matrix_from_zyx), logs = R.map(math.log_so3), q = ends.map(math.quaternion_from_zyx);
      const ways = {
        "ZYX angles": (share) => math.matrix_from_zyx(between(...ends, share)),
        "matrix entries": (share) => range(3).map((i) => between(R[0][i], R[1][i], share)),
        quaternions: (share) => math.matrix_from_quaternion(math.slerp(...q, share)),
        "rotation vectors": (share) => math.exp_so3(between(...logs, share)),
      };
      for (const [way, at] of Object.entries(ways)) {
        const path = times.map(at), now = at(t), nose = path.filter((_, k) => k % 4 === 0).map((M) => M.map((row) => row[0]));
        points[way] = box([1.3, 0.8, 0.25], now, [0, 0, 0]);
        points[`${way} path`] = nose;
        points[`${way} start`] = nose.slice(0, 1);
        points[`${way} goal`] = nose.slice(-1);
        points[`${way} nose`] = [0.65, 1].map((far) => now.map((row) => far * row[0]));
        if (way === "matrix entries") {
          const det = math.det(now), fate = det > 1 - 1e-9 ? "a rotation" : "not a rotation";
          said.push([way, `${fate}, determinant ${numbers([det], 2)}`]);
          if (det < 1e-9) said.push(["its box", "squashed to a line"]);
        } else {
          const turned = path.slice(1).reduce((sum, M, k) => sum + math.angle_between(path[k], M), 0);
          said.push([way, `${numbers([degrees(turned)], 0)}° in all`]);
        }
      }
      return { points, said };
    },
  };

  // Return the drawing of a face. It is the lighter, the more the face is turned to the light, as in space.py.
  function shaded({ style: [old, ...style] }, corners, colour, middle) {
    const n = rbcourseScene.normal(corners), side = Math.sign(dot(n, minus(mean(corners), middle)));
    const light = Math.round(32 * (0.84 + 0.16 * side * dot(n, [0.48, -0.36, 0.8]))) / 32;
    const parts = [1, 3, 5].map((k) => Math.round(light * parseInt(colour.slice(k, k + 2), 16)));
    const fill = `#${parts.map((part) => Math.min(255, part).toString(16).padStart(2, "0")).join("")}${old.slice(7)}`;
    return { style: [fill, ...style], runs: [corners] };
  }

  // Return an explorer for display.js. A part has the map from its axes to pixels; a name moves from its anchor.
  const placed = ({ title, show, moved, on, point }) => (parts, drawings) => ({
    state(values) {
      const { points, said } = show(values);
      const all = parts.flatMap(({ name, axes, anchor, colours }, i) => {
        if (!name) return drawings[i]; // these artists do not move
        if (!points[name].length) return [];
        const to = (place) => place.map((x, k) => axes[2 * k] * x + axes[2 * k + 1]);
        if (colours) {
          const faces = points[name].map((corners) => corners.map(to)), middle = mean(faces.flat());
          return faces.map((corners, k) => shaded(drawings[i][k], corners, colours[k], middle));
        }
        const places = points[name].map(to), [right, down] = anchor ? places[0].map((x, k) => Math.round(x) - anchor[k]) : [];
        const run = (old) => (anchor ? old.map(([x, y]) => [x + right, y + down]) : places);
        return drawings[i].map(({ style, runs }) => ({ style, runs: runs.map(run) }));
      });
      return [all, [said, "", `${title}. ${said.map((pair) => pair.join(": ").split(/\s+/).join(" ")).join("; ")}`]];
    },
    moved,
    point: point && (([x, y], values) => {
      const [sx, x0, sy, y0] = parts.find(({ name }) => name === on).axes;
      return point([(x - x0) / sx, (y - y0) / sy], values);
    }),
  });
  const all = { arm, interpolation, planar: plan, projection, rotation: orientation, screw, theta };
  for (const [name, explorer] of Object.entries(all)) rbcourseDisplay.explorers[name] = placed(explorer);
  return { math, ...all };
})();
