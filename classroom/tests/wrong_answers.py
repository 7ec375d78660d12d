"""What people hand in that is wrong: for each answer cell, pairs of a hint's beginning and code.

The code is the body of the function that is asked for, written as a student would write it.
"""

WRONG = {
    ("ps1", "pose-matrix"): [
        (
            "Sine and cosine are exchanged",
            """
            s, c = np.cos(pose[2]), np.sin(pose[2])
            return np.array([[c, -s, pose[0]], [s, c, pose[1]], [0, 0, 1]])
            """,
        ),
        (
            "x and y are exchanged",
            """
            c, s = np.cos(pose[2]), np.sin(pose[2])
            return np.array([[c, -s, pose[1]], [s, c, pose[0]], [0, 0, 1]])
            """,
        ),
        (
            "The body turns the wrong way",
            """
            x, y, th = pose
            return np.array([[np.cos(th), np.sin(th), x], [-np.sin(th), np.cos(th), y], [0, 0, 1]])
            """,
        ),
        (
            "The whole matrix is transposed",
            """
            c, s = np.cos(pose[2]), np.sin(pose[2])
            return np.array([[c, s, 0], [-s, c, 0], [pose[0], pose[1], 1]])
            """,
        ),
        (
            "This is the inverse",
            """
            c, s = np.cos(pose[2]), np.sin(pose[2])
            x, y = pose[:2]
            return [[c, s, -c * x - s * y], [-s, c, s * x - c * y], [0, 0, 1]]
            """,
        ),
        (
            "Angles are in radians",
            """
            theta = np.deg2rad(pose[2])
            M = np.eye(3)
            M[:2, :2] = [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]
            M[:2, 2] = pose[:2]
            return M
            """,
        ),
        (
            "Angles are in radians",
            """
            theta = pose[2] * 180 / np.pi
            M = np.eye(3)
            M[:2, :2] = [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]
            M[:2, 2] = pose[:2]
            return M
            """,
        ),
    ],
    ("ps1", "seen"): [
        (
            "The signs are wrong",
            """
            c, s = np.cos(pose[2]), np.sin(pose[2])
            return np.array([[c, s], [-s, c]]) @ (pose[:2] - point)
            """,
        ),
        (
            "The second number is how far to the *left*",
            """
            dx, dy = point - pose[:2]
            c, s = np.cos(pose[2]), np.sin(pose[2])
            return np.array([c * dx + s * dy, s * dx - c * dy])
            """,
        ),
        ("The turn is missing", "return point - pose[:2]"),
        (
            "This goes the other way",
            """
            c, s = np.cos(pose[2]), np.sin(pose[2])
            return np.array([[c, -s], [s, c]]) @ point + pose[:2]
            """,
        ),
        (
            "The body's centre is missing",
            """
            c, s = np.cos(pose[2]), np.sin(pose[2])
            return np.array([[c, s], [-s, c]]) @ point
            """,
        ),
        (
            "The turn goes the wrong way",
            """
            c, s = np.cos(pose[2]), np.sin(pose[2])
            return np.array([[c, -s], [s, c]]) @ (point - pose[:2])
            """,
        ),
        (
            "The order is wrong",
            """
            c, s = np.cos(pose[2]), np.sin(pose[2])
            return np.array([[c, s], [-s, c]]) @ point - pose[:2]
            """,
        ),
        (
            "Angles are in radians",
            """
            th = np.radians(pose[2])
            dx, dy = point - pose[:2]
            return [np.cos(th) * dx + np.sin(th) * dy, np.cos(th) * dy - np.sin(th) * dx]
            """,
        ),
    ],
    ("ps1", "plan"): [
        (
            "All your poses are the last one",
            """
            pose = np.array(start, float)
            poses = [pose]
            for v, d in plan:
                pose += v * d
                poses.append(pose)
            return np.array(poses)
            """,
        ),
        (
            "The headings are folded",
            """
            poses = [start]
            for v, d in plan:
                x, y, th = poses[-1] + v * d
                poses.append(np.array([x, y, np.arctan2(np.sin(th), np.cos(th))]))
            x, y, th = start
            poses[0] = np.array([x, y, np.arctan2(np.sin(th), np.cos(th))])
            return np.array(poses)
            """,
        ),
        (
            "The durations are missing",
            """
            poses = [start]
            for v, d in plan:
                poses.append(poses[-1] + v)
            return np.array(poses)
            """,
        ),
        (
            "The start is missing",
            """
            poses, now = [], start.copy()
            for v, d in plan:
                now = now + v * d
                poses.append(now)
            return np.array(poses)
            """,
        ),
        (
            "Only the last pose",
            """
            for v, d in plan:
                start = start + v * d
            return start
            """,
        ),
        (
            "Each command starts at the start",
            """
            return np.array([start] + [start + v * d for v, d in plan])
            """,
        ),
        (
            "You take the velocities along the axes of the body",
            """
            poses = [np.array(start, float)]
            for (vx, vy, w), d in plan:
                x, y, th = poses[-1]
                x += (np.cos(th) * vx - np.sin(th) * vy) * d
                y += (np.sin(th) * vx + np.cos(th) * vy) * d
                poses.append(np.array([x, y, th + w * d]))
            return np.array(poses)
            """,
        ),
        (
            "You take the velocities along the axes of the body",
            """
            poses = [np.array(start, float)]
            for (vx, vy, w), d in plan:
                x, y, th = poses[-1]
                if w == 0:
                    dx, dy = vx * d, vy * d
                else:
                    s, c = np.sin(w * d) / w, (1 - np.cos(w * d)) / w
                    dx, dy = s * vx - c * vy, c * vx + s * vy
                x += np.cos(th) * dx - np.sin(th) * dy
                y += np.sin(th) * dx + np.cos(th) * dy
                poses.append(np.array([x, y, th + w * d]))
            return np.array(poses)
            """,
        ),
        (
            "Your plan starts from (0, 0, 0)",
            """
            poses = np.zeros((len(plan) + 1, 3))
            for i, (v, d) in enumerate(plan):
                poses[i + 1] = poses[i] + v * d
            return poses
            """,
        ),
        (
            "Your function changes the arguments",
            """
            poses = [start.copy()]
            for v, d in plan:
                start += v * d
                poses.append(start.copy())
            return np.array(poses)
            """,
        ),
    ],
    ("ps1", "short"): [
        (
            "One turn more or less is not always enough",
            """
            d = goal - start
            if d > np.pi:
                d -= 2 * np.pi
            elif d < -np.pi:
                d += 2 * np.pi
            return start + t * d
            """,
        ),
        (
            "The result is in degrees",
            """
            d = np.angle(np.exp(1j * (goal - start)))
            return np.rad2deg(start + t * d)
            """,
        ),
        (
            "You turn away from the goal",
            """
            d = np.angle(np.exp(1j * (start - goal)))
            return start + t * d
            """,
        ),
        (
            "This blends the numbers as they are",
            "return start + t * ((goal - start + 180) % 360 - 180)",
        ),
        ("This blends the numbers as they are", "return (1 - t) * start + t * goal"),
        (
            "You take the long way",
            """
            d = (goal - start) % (2 * np.pi)
            if d < np.pi:
                d = d - 2 * np.pi
            return start + t * d
            """,
        ),
        (
            "The way is right, but the result is folded",
            """
            d = np.arctan2(np.sin(goal - start), np.cos(goal - start))
            angle = start + t * d
            return np.arctan2(np.sin(angle), np.cos(angle))
            """,
        ),
        (
            "You always turn to the left",
            """
            d = abs(np.angle(np.exp(1j * (goal - start))))
            return start + t * d
            """,
        ),
        ("You always turn to the left", "return start + t * np.mod(goal - start, 2 * np.pi)"),
        (
            "You fold both headings first",
            """
            a, b = np.mod(start, 2 * np.pi), np.mod(goal, 2 * np.pi)
            return a + t * (b - a)
            """,
        ),
    ],
    ("ps1", "joints"): [
        (
            "You let the motors take the short way",
            """
            d = goal - start
            return start + t * np.arctan2(np.sin(d), np.cos(d))
            """,
        ),
        (
            "This is the formula as the report prints it",
            """
            th0 = (1 - t) * start[0] + t * start[1]
            th1 = (1 - t) * goal[0] + t * goal[1]
            return np.array([th0, th1])
            """,
        ),
        ("At t = 0 your arm is at the goal", "return goal + (start - goal) * t"),
        ("This adds t times the goal", "return start + goal * t"),
    ],
    ("ps1", "tip"): [
        (
            "The two lengths are exchanged",
            """
            b, a = lengths
            q = start + np.linspace(0, 1, 41)[:, None] * (goal - start)
            x = a * np.cos(q[:, 0]) + b * np.cos(q.sum(axis=1))
            ax.plot(x, a * np.sin(q[:, 0]) + b * np.sin(q.sum(axis=1)))
            """,
        ),
        (
            "x and y are swapped",
            """
            q = start + np.linspace(0, 1, 41)[:, None] * (goal - start)
            x = lengths[0] * np.cos(q[:, 0]) + lengths[1] * np.cos(q.sum(axis=1))
            y = lengths[0] * np.sin(q[:, 0]) + lengths[1] * np.sin(q.sum(axis=1))
            ax.plot(y, x)
            ax.set(xlabel="x [m]", ylabel="y [m]")
            """,
        ),
        (
            "These are the angles",
            """
            q = np.array([(1 - t) * start + t * goal for t in np.linspace(0, 1, 41)])
            ax.plot(q[:, 0], q[:, 1])
            """,
        ),
        (
            "This is the way of the elbow",
            """
            q = np.array([(1 - t) * start + t * goal for t in np.linspace(0, 1, 41)])
            ax.scatter(lengths[0] * np.cos(q[:, 0]), lengths[0] * np.sin(q[:, 0]))
            """,
        ),
        (
            "The second angle is measured from the first link",
            """
            for t in np.linspace(0, 1, 41):
                pass
            q = np.array([(1 - t) * start + t * goal for t in np.linspace(0, 1, 41)])
            x = lengths[0] * np.cos(q[:, 0]) + lengths[1] * np.cos(q[:, 1])
            y = lengths[0] * np.sin(q[:, 0]) + lengths[1] * np.sin(q[:, 1])
            ax.plot(x, y)
            """,
        ),
        (
            "This is the straight line",
            """
            ends = []
            for q in (start, goal):
                x = lengths[0] * np.cos(q[0]) + lengths[1] * np.cos(q[0] + q[1])
                ends.append([x, lengths[0] * np.sin(q[0]) + lengths[1] * np.sin(q[0] + q[1])])
            ax.plot(*np.linspace(ends[0], ends[1], 41).T)
            """,
        ),
        (
            "The curves are right. The y axis needs a label",
            """
            q = start + np.linspace(0, 1, 41)[:, None] * (goal - start)
            x = lengths[0] * np.cos(q[:, 0]) + lengths[1] * np.cos(q.sum(axis=1))
            y = lengths[0] * np.sin(q[:, 0]) + lengths[1] * np.sin(q.sum(axis=1))
            ax.plot(x, y)
            ax.set_xlabel("x [m]")
            """,
        ),
        ("Nothing was drawn on the axes", "plt.figure()"),
    ],
    ("ps1", "angles"): [
        (
            "np.arctan of a ratio",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            shoulder = np.arctan(b * np.sin(th1) / (a + b * np.cos(th1)))
            return np.arctan2(tip[1], tip[0]) - shoulder, th1
            """,
        ),
        (
            "np.arcsin never gives more",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            return np.arctan2(tip[1], tip[0]) - np.arcsin(b * np.sin(th1) / np.hypot(*tip)), th1
            """,
        ),
        (
            "This is the other elbow",
            """
            a, b = lengths
            th1 = 2 * np.pi - np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            shoulder = np.arctan2(b * np.sin(th1), a + b * np.cos(th1))
            return np.arctan2(tip[1], tip[0]) - shoulder, th1
            """,
        ),
        (
            "The angles are right up to full turns",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b)) - 2 * np.pi
            shoulder = np.arctan2(b * np.sin(th1), a + b * np.cos(th1))
            return np.arctan2(tip[1], tip[0]) - shoulder, th1
            """,
        ),
        (
            "The two angles are exchanged",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            shoulder = np.arctan2(b * np.sin(th1), a + b * np.cos(th1))
            return th1, np.arctan2(tip[1], tip[0]) - shoulder
            """,
        ),
        (
            "x and y are swapped",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            th0 = np.arctan2(tip[0], tip[1]) - np.arctan2(b * np.sin(th1), a + b * np.cos(th1))
            return th0, th1
            """,
        ),
        (
            "x and y are swapped",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            th0 = np.arctan2(tip[0], tip[1]) - np.arctan2(a + b * np.cos(th1), b * np.sin(th1))
            return th0, th1
            """,
        ),
        (
            "np.arctan of a ratio",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            th0 = np.arctan(tip[1] / tip[0]) - np.arctan2(b * np.sin(th1), a + b * np.cos(th1))
            return th0, th1
            """,
        ),
        (
            "This is the other elbow",
            """
            a, b = lengths
            th1 = -np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            th0 = np.arctan2(tip[1], tip[0]) - np.arctan2(b * np.sin(th1), a + b * np.cos(th1))
            return th0, th1
            """,
        ),
        (
            "θ₀ is not the direction of the tip",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            return np.array([np.arctan2(tip[1], tip[0]), th1])
            """,
        ),
        (
            "The angle at the shoulder has the wrong sign",
            """
            a, b = lengths
            r = np.hypot(tip[0], tip[1])
            shoulder = np.arccos((a * a + r * r - b * b) / (2 * a * r))
            th1 = np.pi - np.arccos((a * a + b * b - r * r) / (2 * a * b))
            return np.array([np.arctan2(tip[1], tip[0]) + shoulder, th1])
            """,
        ),
        (
            "You took the angle inside the triangle",
            """
            a, b = lengths
            r = np.hypot(tip[0], tip[1])
            shoulder = np.arccos((a * a + r * r - b * b) / (2 * a * r))
            th1 = np.arccos((a * a + b * b - r * r) / (2 * a * b))
            return np.array([np.arctan2(tip[1], tip[0]) - shoulder, th1])
            """,
        ),
        (
            "θ₁ is measured from link 1",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            th0 = np.arctan2(tip[1], tip[0]) - np.arctan2(b * np.sin(th1), a + b * np.cos(th1))
            return th0, th0 + th1
            """,
        ),
        (
            "These are degrees",
            """
            a, b = lengths
            th1 = np.arccos((tip @ tip - a * a - b * b) / (2 * a * b))
            th0 = np.arctan2(tip[1], tip[0]) - np.arctan2(b * np.sin(th1), a + b * np.cos(th1))
            return np.degrees([th0, th1])
            """,
        ),
    ],
    ("ps2", "turn"): [
        (
            "The last term has n̂²",
            """
            x, y, z = axis / np.linalg.norm(axis)
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K**2
            """,
        ),
        (
            "Sine and cosine are exchanged",
            """
            x, y, z = axis / np.linalg.norm(axis)
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            return np.eye(3) + np.cos(angle) * K + (1 - np.sin(angle)) * K @ K
            """,
        ),
        (
            "The turn goes the wrong way",
            """
            x, y, z = axis / np.linalg.norm(axis)
            K = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
            return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
            """,
        ),
        (
            "Angles are in radians",
            """
            angle = np.radians(angle)
            x, y, z = axis / np.linalg.norm(axis)
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
            """,
        ),
        (
            "The axis need not have the length 1",
            """
            x, y, z = axis
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
            """,
        ),
        (
            "The axis need not have the length 1",
            """
            x, y, z = axis
            c, s, C = np.cos(angle), np.sin(angle), 1 - np.cos(angle)
            return np.array([
                [c + x * x * C, x * y * C - z * s, x * z * C + y * s],
                [y * x * C + z * s, c + y * y * C, y * z * C - x * s],
                [z * x * C - y * s, z * y * C + x * s, c + z * z * C],
            ])
            """,
        ),
        (
            "A term is missing",
            """
            x, y, z = axis / np.linalg.norm(axis)
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            return np.cos(angle) * np.eye(3) + np.sin(angle) * K
            """,
        ),
        (
            "Two forms of the formula are mixed",
            """
            n = axis / np.linalg.norm(axis)
            x, y, z = n
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * np.outer(n, n)
            """,
        ),
        (
            "The sign of the last term",
            """
            x, y, z = axis / np.linalg.norm(axis)
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            return np.eye(3) + np.sin(angle) * K + (np.cos(angle) - 1) * K @ K
            """,
        ),
    ],
    ("ps2", "angles"): [
        ("These are sums or products", "return RZ(yaw) + RY(pitch) + RX(roll)"),
        ("The order is Rz Ry Rx", "return RX(roll) @ RY(pitch) @ RZ(yaw)"),
        ("Yaw and roll are exchanged", "return RZ(roll) @ RY(pitch) @ RX(yaw)"),
        ("Each of your three turns", "return RZ(yaw).T @ RY(pitch).T @ RX(roll).T"),
        ("The turn about y goes the wrong way", "return RZ(yaw) @ RY(pitch).T @ RX(roll)"),
        ("The result is transposed", "return (RZ(yaw) @ RY(pitch) @ RX(roll)).T"),
        ("These are sums or products of entries", "return RZ(yaw) * RY(pitch) * RX(roll)"),
        (
            "Angles are in radians",
            "return RZ(np.radians(yaw)) @ RY(np.radians(pitch)) @ RX(np.radians(roll))",
        ),
    ],
    ("ps2", "further"): [
        ("This is the further turn alone", "return RX(angle)"),
        ("This turns about the x axis of the room", "return RX(angle) @ R"),
        ("This turns about the right axis the wrong way", "return R @ RX(-angle)"),
        ("R Rx Rᵀ is the further turn alone", "return R @ RX(angle) @ np.linalg.inv(R)"),
        ("This is the transpose", "return RX(-angle) @ R.T"),
        ("Angles are in radians", "return R @ RX(np.deg2rad(angle))"),
    ],
    ("ps2", "nearest"): [
        (
            "It is a rotation, but not the nearest",
            """
            U, s, Vt = np.linalg.svd(M)
            R = U @ Vt
            if np.linalg.det(R) < 0:
                R[:, 2] = -R[:, 2]
            return R
            """,
        ),
        (
            "You change a sign also",
            """
            U, s, Vt = np.linalg.svd(M)
            return U @ np.diag([1, 1, -1]) @ Vt
            """,
        ),
        (
            "This is M itself",
            """
            U, s, Vt = np.linalg.svd(M)
            return U @ np.diag(s) @ Vt
            """,
        ),
        ("Only the lengths of the columns", "return M / np.sqrt((M**2).sum(axis=0))"),
        (
            "For some matrices this has the determinant −1",
            """
            U, s, Vt = np.linalg.svd(M)
            return U @ Vt
            """,
        ),
        (
            "np.linalg.svd returns U",
            """
            U, s, V = np.linalg.svd(M)
            return U @ V.T
            """,
        ),
        (
            "np.linalg.svd returns U",
            """
            U, s, V = np.linalg.svd(M)
            d = np.linalg.det(U @ V.T)
            return U @ np.diag([1, 1, d]) @ V.T
            """,
        ),
        (
            "It is a rotation, but not the nearest",
            """
            U, s, Vt = np.linalg.svd(M)
            R = U @ Vt
            if np.linalg.det(R) < 0:
                R[:, 0] *= -1
            return R
            """,
        ),
        (
            "It is a rotation, but not the nearest",
            """
            U, s, Vt = np.linalg.svd(M)
            if np.linalg.det(U @ Vt) < 0:
                U[:, 0] = -U[:, 0]
            return U @ Vt
            """,
        ),
        (
            "It is a rotation, but far away",
            """
            U, s, Vt = np.linalg.svd(M)
            R = U @ Vt
            return R if np.linalg.det(R) > 0 else -R
            """,
        ),
        (
            "This is Gram and Schmidt's",
            """
            x = M[:, 0] / np.linalg.norm(M[:, 0])
            y = M[:, 1] - (x @ M[:, 1]) * x
            y = y / np.linalg.norm(y)
            return np.column_stack([x, y, np.cross(x, y)])
            """,
        ),
        ("This is Gram and Schmidt's", "return np.linalg.qr(M)[0]"),
        (
            "This is the transpose",
            """
            U, s, Vt = np.linalg.svd(M)
            D = np.diag([1, 1, np.linalg.det(U @ Vt)])
            return Vt.T @ D @ U.T
            """,
        ),
        ("This only scales M", "return M / np.cbrt(np.linalg.det(M))"),
    ],
    ("ps2", "far"): [
        (
            "The minus where det M < 0",
            """
            s = np.linalg.svd(M)[1]
            s[0] *= np.sign(np.linalg.det(M))
            return np.sqrt(((s - 1) ** 2).sum())
            """,
        ),
        ("This measures how far MᵀM", "return np.linalg.norm(M.T @ M - np.eye(3))"),
        (
            "This is the square",
            """
            s = np.linalg.svd(M)[1]
            s[-1] *= np.sign(np.linalg.det(M))
            return np.sum((s - 1) ** 2)
            """,
        ),
        (
            "This is what the paper prints",
            """
            return sum((s - 1) ** 2 for s in np.linalg.svd(M)[1])
            """,
        ),
        (
            "Where det M < 0 this is the distance to a mirror",
            """
            U, s, Vt = np.linalg.svd(M)
            return np.linalg.norm(M - U @ Vt)
            """,
        ),
        (
            "This adds the singular values' differences",
            """
            s = np.linalg.svd(M)[1]
            s[-1] *= np.sign(np.linalg.det(M))
            return np.abs(s - 1).sum()
            """,
        ),
        (
            "This is only the largest difference",
            """
            U, s, Vt = np.linalg.svd(M)
            R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
            return np.linalg.norm(M - R, 2)
            """,
        ),
        ("This is the distance to I", "return np.linalg.norm(M - np.eye(3))"),
    ],
    ("ps2", "line"): [
        (
            "This is the distance from R",
            """
            d = [np.linalg.norm((1 - s) * np.eye(3) + s * R - R) for s in t]
            ax.plot(t, d)
            """,
        ),
        (
            "x and y are swapped",
            """
            d = [FAR((1 - s) * np.eye(3) + s * R) for s in t]
            ax.plot(d, t)
            """,
        ),
        (
            "These are the squares",
            """
            d = [FAR((1 - s) * np.eye(3) + s * R) ** 2 for s in t]
            ax.plot(t, d)
            """,
        ),
        (
            "This is the distance from I",
            """
            d = [np.linalg.norm((1 - s) * np.eye(3) + s * R - np.eye(3)) for s in t]
            ax.plot(t, d)
            """,
        ),
        (
            "Only the numbers of the points",
            """
            d = [FAR((1 - s) * np.eye(3) + s * R) for s in t]
            ax.plot(d)
            """,
        ),
    ],
    ("ps3", "direction"): [
        (
            "These are points of a cube",
            """
            p = 2 * rng.random(3) - 1
            return p / np.linalg.norm(p)
            """,
        ),
        (
            "These crowd at the poles",
            """
            th, ph = np.pi * rng.random(), 2 * np.pi * rng.random()
            return np.array([np.sin(th) * np.cos(ph), np.sin(th) * np.sin(ph), np.cos(th)])
            """,
        ),
        (
            "These crowd at the poles",
            """
            lat, lon = rng.uniform(-np.pi / 2, np.pi / 2), rng.uniform(-np.pi, np.pi)
            return np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
            """,
        ),
        (
            "All your numbers are positive",
            """
            p = rng.random(3)
            return p / np.linalg.norm(p)
            """,
        ),
        (
            "These are on one half of the sphere",
            """
            z, ph = rng.random(), rng.uniform(0, 2 * np.pi)
            r = np.sqrt(1 - z * z)
            return np.array([r * np.cos(ph), r * np.sin(ph), z])
            """,
        ),
        ("A direction has the length 1", "return rng.normal(size=3)"),
        (
            "Every call returns the same draw",
            """
            rng = np.random.default_rng(0)
            p = rng.normal(size=3)
            return p / np.linalg.norm(p)
            """,
        ),
    ],
    ("ps3", "density"): [
        ("This adds up to π", "return 1 - np.cos(a)"),
        ("This is the same for all angles", "return 1 / np.pi"),
        ("This is the density of the angle between", "return np.sin(a) / 2"),
        ("This adds up to ½", "return (1 - np.cos(a)) / (2 * np.pi)"),
        ("This is the probability", "return (a - np.sin(a)) / np.pi"),
        ("This is what rotation vectors give", "return 3 * a**2 / np.pi**3"),
        ("The angle comes in radians", "return (1 - np.cos(a * np.pi / 180)) / np.pi"),
    ],
    ("ps3", "histogram"): [
        (
            "The line of the density is right",
            """
            ax.hist(angles, density=True)
            ax.plot(edges, (1 - np.cos(edges)) / np.pi)
            """,
        ),
        (
            "The bars are shares",
            """
            ax.hist(angles, edges, weights=np.full(len(angles), 1 / len(angles)))
            ax.plot(edges, (1 - np.cos(edges)) / np.pi)
            """,
        ),
        (
            "The bars stand with their middles",
            """
            heights = np.histogram(angles, edges, density=True)[0]
            ax.bar(edges[:-1], heights, width=np.diff(edges))
            ax.plot(edges, (1 - np.cos(edges)) / np.pi)
            """,
        ),
        (
            "The bars are counts",
            """
            ax.hist(angles, edges)
            ax.plot(edges, (1 - np.cos(edges)) / np.pi)
            """,
        ),
        ("The bars are right. The line of the density", "ax.hist(angles, edges, density=True)"),
        (
            "These are degrees",
            """
            ax.hist(np.degrees(angles), np.degrees(edges), density=True)
            ax.plot(np.degrees(edges), (1 - np.cos(edges)) / np.pi)
            """,
        ),
    ],
    ("ps3", "quaternion"): [
        (
            "The axis is uniform, and so is the angle",
            """
            n = rng.normal(size=3)
            while True:
                a = rng.uniform(0, np.pi)
                if rng.random() < (1 - np.cos(a)) / 2:
                    return np.array([np.cos(a), *(np.sin(a) * n / np.linalg.norm(n))])
            """,
        ),
        (
            "Three uniform angles",
            """
            a, b, g = rng.uniform(0, 2 * np.pi, 3) / 2
            q = np.array([np.cos(a), 0, 0, np.sin(a)])
            for half, axis in ((b, 2), (g, 1)):
                turn = np.zeros(4)
                turn[0], turn[axis] = np.cos(half), np.sin(half)
                w, v = q[0] * turn[0] - q[1:] @ turn[1:], np.cross(q[1:], turn[1:])
                q = np.array([w, *(q[0] * turn[1:] + turn[0] * q[1:] + v)])
            return q
            """,
        ),
        (
            "The length is between 0.71 and 1",
            """
            s, a, b = rng.random(), 2 * np.pi * rng.random(), 2 * np.pi * rng.random()
            r = 1 - s
            return np.array([s * np.cos(b), r * np.sin(a), r * np.cos(a), s * np.sin(b)])
            """,
        ),
        (
            "The length is right, the law is not",
            """
            s, a, b = rng.random(), 2 * np.pi * rng.random(), 2 * np.pi * rng.random()
            q = np.array([s * np.cos(b), (1 - s) * np.sin(a), (1 - s) * np.cos(a), s * np.sin(b)])
            return q / np.linalg.norm(q)
            """,
        ),
        (
            "These are points of a cube",
            """
            q = rng.uniform(-1, 1, 4)
            return q / np.linalg.norm(q)
            """,
        ),
        (
            "All your numbers are positive",
            """
            q = rng.random(4)
            return q / np.linalg.norm(q)
            """,
        ),
        (
            "The axis is uniform, and so is the angle",
            """
            n = rng.normal(size=3)
            half = rng.uniform(0, 2 * np.pi) / 2
            return np.array([np.cos(half), *(np.sin(half) * n / np.linalg.norm(n))])
            """,
        ),
        (
            "Both angles go only half way",
            """
            s, a, b = rng.random(), np.pi * rng.random(), np.pi * rng.random()
            r, q = np.sqrt(s), np.sqrt(1 - s)
            return np.array([r * np.cos(b), q * np.sin(a), q * np.cos(a), r * np.sin(b)])
            """,
        ),
        ("A unit quaternion has the length 1", "return rng.normal(size=4)"),
    ],
    ("ps3", "rotation"): [
        (
            "Three uniform angles",
            """
            a, b, g = 2 * np.pi * rng.random(3)
            return RZ(a) @ RY(b) @ RX(g)
            """,
        ),
        (
            "Three uniform angles",
            """
            a, b, g = 2 * np.pi * rng.random(), np.pi * rng.random(), 2 * np.pi * rng.random()
            return RZ(a) @ RY(b) @ RZ(g)
            """,
        ),
        (
            "A root is missing",
            """
            a, b, z = 2 * np.pi * rng.random(), 2 * np.pi * rng.random(), rng.random()
            V = np.array([np.cos(b) * z, np.sin(b) * z, np.sqrt(1 - z**2)])
            return -(np.eye(3) - 2 * np.outer(V, V)) @ RZ(a)
            """,
        ),
        (
            "A draw is no rotation. If you reflect",
            """
            a, b, z = 2 * np.pi * rng.random(), 2 * np.pi * rng.random(), rng.random()
            V = np.array([np.cos(b) * z, np.sin(b) * z, np.sqrt(1 - z)])
            return -(np.eye(3) - 2 * np.outer(V, V)) @ RZ(a)
            """,
        ),
        (
            "The determinant is −1 for all",
            """
            a, b, z = 2 * np.pi * rng.random(), 2 * np.pi * rng.random(), rng.random()
            V = np.array([np.cos(b) * np.sqrt(z), np.sin(b) * np.sqrt(z), np.sqrt(1 - z)])
            return (np.eye(3) - 2 * np.outer(V, V)) @ RZ(a)
            """,
        ),
        (
            "The determinant is −1 for ",
            """
            Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
            return Q * np.sign(np.diag(R))
            """,
        ),
        (
            "The axis is uniform, and so is the angle",
            """
            n = rng.normal(size=3)
            n = n / np.linalg.norm(n)
            a = rng.uniform(0, np.pi)
            K = np.cross(n, -np.eye(3))
            return np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K
            """,
        ),
        (
            "Q of a QR decomposition",
            """
            Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
            if np.linalg.det(Q) < 0:
                Q[:, 0] = -Q[:, 0]
            return Q
            """,
        ),
        (
            "The turn about z goes only half way",
            """
            a, b, z = np.pi * rng.random(), 2 * np.pi * rng.random(), rng.random()
            V = np.array([np.cos(b) * np.sqrt(z), np.sin(b) * np.sqrt(z), np.sqrt(1 - z)])
            return -(np.eye(3) - 2 * np.outer(V, V)) @ RZ(a)
            """,
        ),
        ("A draw is no rotation: its singular values", "return rng.normal(size=(3, 3))"),
    ],
    ("ps4", "geodesic"): [
        (
            "A part of one turn after a part of the other",
            "return exp_so3((1 - t) * log_so3(R0)) @ exp_so3(t * log_so3(R1))",
        ),
        ("A transpose is missing", "return R0 @ exp_so3(t * log_so3(R0 @ R1))"),
        (
            "Rotation vectors cannot be subtracted",
            "return R0 @ exp_so3(t * (log_so3(R1) - log_so3(R0)))",
        ),
        ("This starts at I", "return exp_so3(t * log_so3(R1 @ R0.T))"),
        ("Two frames are mixed", "return R0 @ exp_so3(t * log_so3(R1 @ R0.T))"),
        ("Two frames are mixed", "return exp_so3(t * log_so3(R0.T @ R1)) @ R0"),
        ("This starts at R₁", "return R0 @ exp_so3((1 - t) * log_so3(R0.T @ R1))"),
        ("This sets out from R₀ in the opposite", "return R0 @ exp_so3(t * log_so3(R1.T @ R0))"),
        (
            "This goes the long way",
            """
            w = log_so3(R0.T @ R1)
            a = np.linalg.norm(w)
            return R0 @ exp_so3(-t * w / a * (2 * np.pi - a))
            """,
        ),
        ("This starts at I", "return exp_so3(t * log_so3(R0.T @ R1))"),
        ("This is the straight line", "return R0 + t * (R1 - R0)"),
        ("Blended rotation vectors", "return exp_so3(log_so3(R0) * (1 - t) + log_so3(R1) * t)"),
    ],
    ("ps4", "theta"): [
        ("This is a weight of Slerp", "return np.sin(a * t) / np.sin(a)"),
        ("x and y are swapped", "return np.arctan2(1 - t + t * np.cos(a), t * np.sin(a)) / a"),
        ("This is the angle turned", "return np.arctan2(t * np.sin(a), 1 - t + t * np.cos(a))"),
        (
            "np.arctan of a ratio",
            "return np.arctan(t * np.sin(a) / (1 - t + t * np.cos(a))) / a",
        ),
        (
            "This is the other function",
            "return np.sin(a * t) / (np.sin(a * t) + np.sin(a * (1 - t)))",
        ),
        ("This is where the geodesic is", "return t"),
        (
            "Angles are in radians",
            "return np.degrees(np.arctan2(t * np.sin(a), 1 - t + t * np.cos(a))) / a",
        ),
    ],
    ("ps4", "rate"): [
        (
            "This is what the paper prints",
            "return np.sin(a) / (a * np.sqrt(1 - 2 * (1 - np.cos(a)) * t * (1 - t)))",
        ),
        (
            "A division by a is missing",
            "return np.sin(a) / (1 - 2 * (1 - np.cos(a)) * t * (1 - t))",
        ),
        (
            "s is the root in (17)",
            """
            s = 1 - 2 * (1 - np.cos(a)) * t * (1 - t)
            return np.sin(a) / (a * s**2)
            """,
        ),
        (
            "This is the rate of f",
            """
            S, T = np.sin(a * t), np.sin(a * (1 - t))
            return (a * np.cos(a * t) * T + S * a * np.cos(a * (1 - t))) / (S + T) ** 2
            """,
        ),
    ],
    ("ps4", "shadow"): [
        (
            "The arguments of np.arctan2",
            """
            for a in angles:
                ax.plot(t, np.arctan2(1 - t + t * np.cos(a), t * np.sin(a)) / a)
            """,
        ),
        (
            "These are straight lines",
            """
            for a in angles:
                ax.plot(t, t)
            """,
        ),
        ("x and y are swapped", "for a in angles:\n    ax.plot(SHARE(t, a), t)"),
        (
            "These are the curves of f",
            """
            for a in angles:
                ax.plot(t, np.sin(a * t) / (np.sin(a * t) + np.sin(a * (1 - t))))
            """,
        ),
        ("This is the angle turned", "for a in angles:\n    ax.plot(t, a * SHARE(t, a))"),
        (
            "This is the rate",
            "for a in angles:\n"
            "    s2 = 1 - 2 * (1 - np.cos(a)) * t * (1 - t)\n"
            "    ax.plot(t, np.sin(a) / (a * s2))",
        ),
        ("The angles come in radians", "for a in np.radians(angles):\n    ax.plot(t, SHARE(t, a))"),
        ("Not all of the curves", "ax.plot(t, SHARE(t, angles[0]))"),
    ],
    ("ps4", "screw"): [
        (
            "This sets out from A₀ in the opposite",
            "return A0 @ exp_se3(t * log_se3(np.linalg.inv(A1) @ A0))",
        ),
        ("Twists of two poses", "return exp_se3((1 - t) * log_se3(A0) + t * log_se3(A1))"),
        (
            "This turns evenly and moves the origin",
            """
            A = np.eye(4)
            R0, R1 = A0[:3, :3], A1[:3, :3]
            A[:3, :3] = R0 @ exp_so3(t * log_so3(R0.T @ R1))
            A[:3, 3] = A0[:3, 3] + t * (A1[:3, 3] - A0[:3, 3])
            return A
            """,
        ),
        ("Two frames are mixed", "return A0 @ exp_se3(t * log_se3(A1 @ np.linalg.inv(A0)))"),
        ("The inverse of a pose", "return A0 @ exp_se3(t * log_se3(A0.T @ A1))"),
        (
            "The inverse of a pose",
            """
            inverse = np.eye(4)
            inverse[:3, :3] = A0[:3, :3].T
            inverse[:3, 3] = -A0[:3, 3]
            return A0 @ exp_se3(t * log_se3(inverse @ A1))
            """,
        ),
        ("This starts at A₁", "return A1 @ exp_se3(t * log_se3(np.linalg.inv(A1) @ A0))"),
        ("This starts at I", "return exp_se3(t * log_se3(np.linalg.inv(A0) @ A1))"),
        ("Blended matrices", "return A0 * (1 - t) + A1 * t"),
    ],
    ("ps5", "cubic"): [
        ("The velocity at the start has", "return HERMITE(p0, p1, -v0, v1, t)"),
        ("Both velocities have", "return HERMITE(p0, p1, -v0, -v1, t)"),
        (
            "The velocity at the end has the wrong sign",
            "return HERMITE(p0, p1, v0, -v1, t)",
        ),
        ("The velocities are exchanged", "return HERMITE(p0, p1, v1, v0, t)"),
        (
            "The velocities come out three times",
            """
            a, b = p0 + v0, p1 - v1
            return (1 - t)**3 * p0 + 3 * (1 - t)**2 * t * a + 3 * (1 - t) * t**2 * b + t**3 * p1
            """,
        ),
        ("The velocities are not used", "return p0 + (3 * t**2 - 2 * t**3) * (p1 - p0)"),
        ("This is the straight line", "return p0 + t * (p1 - p0)"),
        (
            "The second velocity is taken",
            """
            A = np.array([[1, 0, 0, 0], [1, 1, 1, 1], [0, 1, 0, 0], [0, 0, 2, 6]])
            c = np.linalg.solve(A, np.reshape([p0, p1, v0, v1], (4, -1)))
            return (c[0] + c[1] * t + c[2] * t**2 + c[3] * t**3).reshape(p0.shape)
            """,
        ),
    ],
    ("ps5", "rate"): [
        ("R ω̂ Rᵀ is the hat", "return R @ hat_so3(w) @ R.T"),
        ("This takes ω along the axes of the room", "return hat_so3(w) @ R"),
        ("The sign is wrong", "return R @ hat_so3(w).T"),
        ("R is missing", "return hat_so3(w)"),
        ("The product of a matrix and a vector", "return R @ w"),
        ("This is the transpose", "return hat_so3(w).T @ R.T"),
    ],
    ("ps5", "projected"): [
        (
            "For some matrices this is a mirror",
            """
            M = HERMITE(R0, R1, R0 @ hat_so3(w0), R1 @ hat_so3(w1), t)
            U, s, Vt = np.linalg.svd(M)
            return U @ Vt
            """,
        ),
        (
            "The two velocities are exchanged",
            "return project_so(HERMITE(R0, R1, R0 @ hat_so3(w1), R1 @ hat_so3(w0), t))",
        ),
        (
            "You take the angular velocities",
            "return project_so(HERMITE(R0, R1, R0 @ hat_so3(w0), hat_so3(w1) @ R1, t))",
        ),
        (
            "This is the cubic through the matrices",
            "return HERMITE(R0, R1, R0 @ hat_so3(w0), R1 @ hat_so3(w1), t)",
        ),
        (
            "You take the angular velocities",
            "return project_so(HERMITE(R0, R1, hat_so3(w0) @ R0, hat_so3(w1) @ R1, t))",
        ),
        (
            "The velocities are not used",
            "return project_so(R0 + (3 * t**2 - 2 * t**3) * (R1 - R0))",
        ),
        ("This is the projected line", "return project_so(R0 + t * (R1 - R0))"),
        (
            "The last condition is printed with two dots",
            """
            B, C = R0 @ hat_so3(w0), R1 @ hat_so3(w1)
            c3 = (C - 2 * (R1 - R0 - B)) / 4
            return project_so(R0 + t * B + t**2 * (R1 - R0 - B - c3) + t**3 * c3)
            """,
        ),
        (
            "R₁ is missing",
            "return project_so(HERMITE(R0, R1, R0 @ hat_so3(w0), R0 @ hat_so3(w1), t))",
        ),
        (
            "A velocity has the wrong sign",
            "return project_so(HERMITE(R0, R1, -R0 @ hat_so3(w0), -R1 @ hat_so3(w1), t))",
        ),
    ],
    ("ps5", "third"): [
        ("The sign is wrong", "return np.cross(w, w2)"),
        ("This uses ω′", "return -np.cross(w, w1)"),
        ("ω itself is missing", "return -np.cross(w1, w2)"),
        ("With 0 the angular velocity", "return np.zeros(3)"),
        ("This multiplies entry by entry", "return -w * w2"),
    ],
    ("ps5", "cost"): [
        ("This is the mean over all", "return 2 * np.mean(w1**2)"),
        (
            "The factor 2 of (18)",
            "return np.trapezoid((w1**2).sum(axis=1), np.linspace(0, 1, len(w1)))",
        ),
        ("The integral is missing its dt", "return 2 * np.sum(w1**2)"),
        ("The norm is to be squared", "return 2 * np.mean(np.linalg.norm(w1, axis=1))"),
        ("There is a root too many", "return np.sqrt(2 * np.mean(np.sum(w1**2, axis=1)))"),
        ("This adds the components first", "return 2 * np.mean(np.sum(w1, axis=1) ** 2)"),
        (
            "This differentiates once more",
            """
            d = np.diff(w1, axis=0) * (len(w1) - 1)
            return 2 * np.mean(np.sum(d**2, axis=1))
            """,
        ),
    ],
    ("ps5", "speed"): [
        ("x and y are swapped", "ax.plot(np.linalg.norm(w, axis=1), t)"),
        ("These are the components", "ax.plot(t, w)"),
        ("This is the square of the speed", "ax.plot(t, (w**2).sum(axis=1))"),
        ("This is the sum of the components", "ax.plot(t, np.abs(w).sum(axis=1))"),
        ("Only the numbers of the points", "ax.plot(np.linalg.norm(w, axis=1))"),
    ],
    ("ps6", "torque"): [
        ("The second term is missing", "return G @ w1"),
        ("The sign of the second term", "return G @ w1 + np.cross(G @ w, w)"),
        ("G multiplies too much", "return G @ (w1 + np.cross(w, G @ w))"),
        ("This is the acceleration", "return w1 + np.linalg.inv(G) @ np.cross(w, G @ w)"),
        (
            "This uses the diagonal",
            """
            g = G.diagonal()
            return g * w1 + np.cross(w, g * w)
            """,
        ),
        ("ω and ω′ are exchanged", "return G @ w + np.cross(w1, G @ w1)"),
        ("The product has ω′", "return G @ w1 + np.cross(w, G @ w1)"),
    ],
    ("ps6", "cost"): [
        (
            "This is the other cost",
            """
            tau = w1 @ G + np.cross(w, w @ G)
            return np.mean((tau**2).sum(axis=1))
            """,
        ),
        (
            "This has G where its inverse",
            """
            tau = w1 @ G + np.cross(w, w @ G)
            return np.mean([x @ G @ x for x in tau])
            """,
        ),
        (
            "The term ω × Gω is missing",
            """
            tau = w1 @ G
            return np.mean([x @ np.linalg.inv(G) @ x for x in tau])
            """,
        ),
        (
            "The sign of ω × Gω in the torque",
            """
            tau = w1 @ G + np.cross(w @ G, w)
            return np.mean([x @ np.linalg.inv(G) @ x for x in tau])
            """,
        ),
        ("This is the cost for a ball", "return 2 * np.mean((w1**2).sum(axis=1))"),
        (
            "The integral is missing its dt",
            """
            tau = w1 @ G + np.cross(w, w @ G)
            return sum(x @ np.linalg.inv(G) @ x for x in tau)
            """,
        ),
        (
            "This is the mean over all",
            """
            tau = w1 @ G + np.cross(w, w @ G)
            return np.mean(tau * (tau @ np.linalg.inv(G)))
            """,
        ),
        (
            "There is a root too many",
            """
            tau = w1 @ G + np.cross(w, w @ G)
            return np.sqrt(np.mean([x @ np.linalg.inv(G) @ x for x in tau]))
            """,
        ),
    ],
    ("ps6", "draw"): [
        (
            "x and y are swapped",
            "ax.plot(np.linalg.norm(w1 @ G + np.cross(w, w @ G), axis=1), t)",
        ),
        ("These are the components", "ax.plot(t, w1 @ G + np.cross(w, w @ G))"),
        (
            "This is the square of the size",
            "ax.plot(t, ((w1 @ G + np.cross(w, w @ G)) ** 2).sum(axis=1))",
        ),
        (
            "This is the size of G⁻¹τ",
            """
            u = w1 + np.cross(w, w @ G) @ np.linalg.inv(G)
            ax.plot(t, np.linalg.norm(u, axis=1))
            """,
        ),
        (
            "The sign of ω × Gω in the torque",
            "ax.plot(t, np.linalg.norm(w1 @ G - np.cross(w, w @ G), axis=1))",
        ),
        ("This is the size of G ω′", "ax.plot(t, np.linalg.norm(w1 @ G, axis=1))"),
        (
            "Only the numbers of the points",
            "ax.plot(np.linalg.norm(w1 @ G + np.cross(w, w @ G), axis=1))",
        ),
    ],
    ("ps6", "nearest"): [
        ("This is the nearest rotation for a ball", "return project_so(M)"),
        ("The inertia is not the weight", "return project_so(M @ G)"),
        ("The half is missing", "return project_so(M @ (np.trace(G) * np.eye(3) - G))"),
        (
            "The weight stands on the wrong side",
            "return project_so((np.trace(G) / 2 * np.eye(3) - G) @ M)",
        ),
        (
            "For some matrices this is a mirror",
            """
            U, s, Vt = np.linalg.svd(M @ (np.trace(G) / 2 * np.eye(3) - G))
            return U @ Vt
            """,
        ),
        ("The unit matrix is missing", "return project_so(M @ (np.trace(G) / 2 - G))"),
        ("This is M W itself", "return M @ (np.trace(G) / 2 * np.eye(3) - G)"),
    ],
    ("ps6", "constant"): [
        ("This is p, as the body", "return G @ (v1 + np.cross(w, v)) - np.cross(G @ w, v)"),
        (
            "This has the transpose",
            "return (G @ (v1 + np.cross(w, v)) - np.cross(G @ w, v)) @ R",
        ),
        (
            "The sign of the last term",
            "return R @ (G @ (v1 + np.cross(w, v)) + np.cross(G @ w, v))",
        ),
        (
            "In the last term G belongs",
            "return R @ (G @ (v1 + np.cross(w, v)) - np.cross(w, G @ v))",
        ),
        ("The last term is missing", "return R @ (G @ (v1 + np.cross(w, v)))"),
        ("Inside of G the product ω × v", "return R @ (G @ v1 - np.cross(G @ w, v))"),
        (
            "Inside of G the product has",
            "return R @ (G @ (v1 + np.cross(v, w)) - np.cross(G @ w, v))",
        ),
        ("This is the constant of a ball", "return R @ (G @ v1)"),
    ],
}

# What these bodies call by capital names: a student would have written it out.
HELP = """
import numpy as np


def RX(a):
    return np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])


def RY(a):
    return np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])


def RZ(a):
    return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])


def FAR(M):
    s = np.linalg.svd(M)[1]
    s[2] *= np.sign(np.linalg.det(M))
    return np.linalg.norm(s - 1)


def SHARE(t, a):
    return np.arctan2(t * np.sin(a), 1 - t + t * np.cos(a)) / a


def HERMITE(p0, p1, v0, v1, t):
    points = [p0, p0 + v0 / 3, p1 - v1 / 3, p1]
    while len(points) > 1:
        points = [(1 - t) * a + t * b for a, b in zip(points, points[1:])]
    return points[0]
"""
