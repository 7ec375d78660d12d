"""Test the formats of recordings, as their publishers describe them, and exact times."""

import logging
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import rbcourse as rb

# Each good file has the pose P at its first time; its quaternion is (0.8, 0, 0, 0.6).
P = np.array([[0.28, -0.96, 0, 1.5], [0.96, 0.28, 0, -0.25], [0, 0, 1, 0.75], [0, 0, 0, 1]])
XYZW, WXYZ, D = "0 0 0.6 0.8", "0.8,0,0,0.6", "1.5,-0.25,0.75"
ROW, ROWS = f"1.5 -0.25 0.75 {XYZW}", f"{D},{WXYZ}"
KITTI = "0.28 -0.96 0 1.5 0.96 0.28 0 -0.25 0 0 1 0.75\n"
EUROC = (
    "#timestamp{}, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
    "q_RS_z []"
)
STATE = ", v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1]"
OWN = "time [s],x [m],y [m],z [m],qw [1],qx [1],qy [1],qz [1]"
ROS = "field.pose.position.x,field.pose.position.y,field.pose.position.z,"
ROS += ",".join(f"field.pose.orientation.{axis}" for axis in "xyzw")
GOOD = {
    # file: (text, options, times)
    "tum_rgbd.txt": (
        f"# ground truth trajectory\n# file: 'fr2.bag'\n# timestamp tx ty tz qx qy qz qw\n"
        f"1311868164.3631 {ROW}\n1311868164.3731 {ROW}\n",
        {"start": "first"},
        [0, 0.01],
    ),
    "pandas_twice.csv": (f"Unnamed: 0,{OWN}\n0,0.5,{ROWS}\n", {}, [0.5]),
    "markers.csv": (f"{OWN},marker 1,marker 2\n0.5,{ROWS},7,8\n", {}, [0.5]),
    "orb_slam2.txt": (f"1305031102.160407 1.5000000 -0.2500000 0.7500000 {XYZW}\n", {}, None),
    "orb_slam3.txt": (
        f"1403636580838555648.000000 {ROW}\n1403636580843555584.000000 {ROW}\n",
        {"unit": "ns", "start": "first"},
        [0, 0.004999936],
    ),
    "ts.txt": (f"# ts tx ty tz qx qy qz qw\n0.5 {ROW}\n", {}, [0.5]),
    "header_no_hash.txt": (f"timestamp tx ty tz qx qy qz qw\n0.0 {ROW}\n", {}, [0]),
    "open_vins.txt": (
        "# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12 Pr13\n"
        f"1403636580.83856 {ROW} 0.01 0 0\n",
        {},
        [1403636580.83856],
    ),
    "both.csv": (f"t,x,y,z,qw,qx,qy,qz,r11,r12,r13\n0.5,{ROWS},9,9,9\n", {}, [0.5]),
    "rpg_with_ids.txt": (f"# id timestamp tx ty tz qx qy qz qw\n7 1.5 {ROW}\n", {}, [1.5]),
    "tabs.txt": (f"0.5 {ROW}\n".replace(" ", "\t"), {}, [0.5]),
    "commas.tum": (f"0.5 {ROW}\n".replace(" ", ","), {}, [0.5]),
    "scientific.txt": (f"5.0e-01   {ROW}\n", {}, [0.5]),
    "comments.txt": (f"0.5 {ROW} # here\n# a break\n\n% and here\n1 {ROW}\n", {}, [0.5, 1]),
    "old_mac.txt": (f"0.5 {ROW}\r1 {ROW}\r", {}, [0.5, 1]),
    "euroc.csv": (
        f"{EUROC.format('')}{STATE}\n1403636580838555648,{ROWS},0,0,0,0\n",
        {"start": "1403636580.8"},
        [0.038555648],
    ),
    "tum_vi.csv": (
        f"{EUROC.format(' [ns]')}\n1520530308206190000,{ROWS}\n1520530308214190000,{ROWS}\n",
        {"start": "first"},
        [0, 0.008],
    ),
    "okvis.csv": (
        "timestamp, p_WS_W_x, p_WS_W_y, p_WS_W_z, q_WS_x, q_WS_y, q_WS_z, q_WS_w, v_WS_W_x\n"
        f"1403636580838555648, 1.5, -0.25, 0.75, {XYZW.replace(' ', ', ')}, 3\n",
        {"unit": "ns"},
        None,
    ),
    "kitti.txt": (KITTI * 2, {"rate": 10}, [0, 0.1]),
    "kitti_times.txt": (KITTI * 2, {"times": [0, 0.1037]}, [0, 0.1037]),
    "newer_college.csv": (
        f"#sec,nsec,x,y,z,qx,qy,qz,qw\n1583836591,182590976,{D},{XYZW.replace(' ', ',')}\n",
        {"start": "1583836591"},
        [0.182590976],
    ),
    "rostopic_echo.csv": (
        f"%time,field.header.seq,field.header.stamp,field.header.frame_id,{ROS}\n"
        f'1583836591182590976,4,1583836591000000000,"map",{D},{XYZW.replace(" ", ",")}\n',
        {"unit": "ns"},
        [1583836591],
    ),
    "ros2_bag.csv": (
        "header.stamp.sec,header.stamp.nanosec,header.frame_id,"
        + ROS.replace("field.", "pose.")
        + f"\n12,500000000,map,{D},{XYZW.replace(' ', ',')}\n",
        {},
        [12.5],
    ),
    "plotjuggler.csv": (
        "__time,"
        + ",".join(f"/odom/pose/pose/position/{axis}" for axis in "xyz")
        + ","
        + ",".join(f"/odom/pose/pose/orientation/{axis}" for axis in "wxyz")
        + ",/odom/twist/twist/linear/x\n"
        + f"1583836591.5,{ROWS},3\n",
        {},
        [1583836591.5],
    ),
    "camel_case.csv": (
        f"timeMs,posX,posY,posZ,rotW,rotX,rotY,rotZ,accX\n1500,{ROWS},9.8\n",
        {},
        [1.5],
    ),
    "airsim_rec.txt": (
        "VehicleName\tTimeStamp\tPOS_X\tPOS_Y\tPOS_Z\tQ_W\tQ_X\tQ_Y\tQ_Z\tImageFile\n"
        + f"Drone\t1583836591182\t{ROWS}".replace(",", "\t")
        + "\timg_1.png\n",
        {"unit": "ms"},
        [1583836591.182],
    ),
    "lamar_trajectories.txt": (
        "# timestamp, device_id, qw, qx, qy, qz, tx, ty, tz\n"
        f"1000.25, phone_3, 0.8, 0, 0, 0.6, {D}\n",
        {},
        [1000.25],
    ),
    "pandas.csv": (f",time,x,y,z,qw,qx,qy,qz,label\n0,0.5,{ROWS},a\n1,1.0,{ROWS},\n", {}, [0.5, 1]),
    "pandas_empty.csv": (f",time,x,y,z,qw,qx,qy,qz,label\n0,0.5,{ROWS},\n1,1,{ROWS},a\n", {}, None),
    "separator_at_end.csv": (f"time,x,y,z,qw,qx,qy,qz\n0.5,{ROWS},\n", {}, [0.5]),
    "excel_german.csv": (
        f"\ufeff{OWN}".replace(",", ";") + "\r\n0,5;1,5;-0,25;0,75;0,8;0;0;0,6\r\n",
        {},
        [0.5],
    ),
    "excel_text.txt": ("0,5\t1,5\t-0,25\t0,75\t0\t0\t0,6\t0,8\r\n", {}, [0.5]),
    "millimetres.csv": (
        f"Time (Seconds),X (mm),Y (mm),Z (mm),QW,QX,QY,QZ\n0.5,1500,-250,750,{WXYZ}\n",
        {},
        [0.5],
    ),
    "units_in_names.csv": (
        f"t_ms,pos_x,pos_y,pos_z,rot_w,rot_x,rot_y,rot_z\n500,{ROWS}\n",
        {},
        [0.5],
    ),
    "tartanair.txt": (f"{ROW}\n{ROW}\n", {"rate": 10}, [0, 0.1]),
    "no_times.csv": (f"x,y,z,qw,qx,qy,qz\n{ROWS}\n", {"times": [3]}, [3]),
    "vins_fusion.csv": (
        f"1403636580838555648,{ROWS},0.1,0,0,\n",
        {"format": "euroc", "start": "1403636580"},
        [0.838555648],
    ),
    "header_in_words.txt": (
        f"# columns: t x y z qw qx qy qz\n0.5 {ROWS}\n".replace(",", " "),
        {},
        [0.5],
    ),
    "header_tabs.txt": (
        f"#\ttime\tx\ty\tz\tqw\tqx\tqy\tqz\n0.5\t{ROWS}\n".replace(",", "\t"),
        {},
        [0.5],
    ),
    "time_nsec.csv": (f"time_nsec,x,y,z,qw,qx,qy,qz\n500000000,{ROWS}\n", {}, [0.5]),
    "axis_first.csv": (f"t,x_position,y_position,z_position,qw,qx,qy,qz\n1,{ROWS}\n", {}, [1]),
    "std.csv": (
        f"t,x,y,z,qw,qx,qy,qz,pos_std_x,pos_std_y,pos_std_z,q_err_w\n1,{ROWS},9,9,9,9\n",
        {},
        [1],
    ),
    "units_below.csv": (
        f"t,x,y,z,qw,qx,qy,qz\nms,mm,mm,mm,,,,\n500,1500,-250,750,{WXYZ}\n",
        {},
        [0.5],
    ),
    "excel_lost.csv": (
        f"{OWN}\n0.5,{ROWS}\n1,#N/A,#N/A,#N/A,#N/A,#N/A,#N/A,#N/A\n",
        {"skip": "nan"},
        [0.5],
    ),
    "one_body.csv": (f"t,child_frame_id,{OWN[9:]}\n0.5,base,{ROWS}\n1,base,{ROWS}\n", {}, [0.5, 1]),
    "own.csv": (f"{OWN}\n0.5,{ROWS}\n\n# here\n1,{ROWS}\n", {}, [0.5, 1]),
    "quoted.csv": (
        f'"time","x","y","z","qw","qx","qy","qz","a, b"\n"0.5",{ROWS},"1, 2"\n',
        {},
        [0.5],
    ),
}  # fmt: skip
MOTIVE = f"""\
Format Version,1.23,Take Name,a,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global

,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body
,Name,Tool,Tool,Tool,Tool,Tool,Tool,Tool,Tool
,ID,"5E","5E","5E","5E","5E","5E","5E","5E"
,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error
Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,
0,0.000000,{XYZW.replace(" ", ",")},{D},0.000214
1,0.010000,,,,,,,,
2,0.020000,{XYZW.replace(" ", ",")},{D},0.000214
"""
UR = "time,x,y,z,rx,ry,rz\n0.0,0.4,0,0.2,0,3.1,0\n0.1,0.4,0,0.3,0,3.1,0.2\n"
VICON = """\
Objects
100
,,Tool:Tool,,,,,
Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ
,,rad,rad,rad,mm,mm,mm
1,0,0,0,1.2870022,1500,-250,750
2,0,,,,,,
3,0,0,0,1.2870022,1500,-250,750
"""
REFUSED = {
    "motive.csv": (MOTIVE, "line 1: for files of Motive and Vicon, docs/recording.md has code"),
    "vicon_tracker.csv": (VICON, "line 1: for files of Motive and Vicon"),
    "kitti.txt": (KITTI, "is a KITTI file, without times: times= takes a file"),
    "kitti_with_frame.txt": ("0 " + KITTI, "13 columns.*format= may be .'time', 'r11'"),
    "replica.txt": ("1 0 0 0 " * 4 + "\n", "16 columns.*reshape"),
    "tartanair.txt": (f"{ROW}\n", "7 columns.*TUM poses without times, times= or rate="),
    "arkit.csv": (f"0.5,{ROWS}\n", "format='tum' reads quaternions.*format='csv'"),
    "leica.csv": (
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m]\n1403636580838555648,1,2,3\n",
        "4 columns without names",
    ),
    "colmap_images.txt": ("1 0.8 0 0 0.6 1.5 0.25 0.75 1 a.jpg\n2 3 -1\n", "10 columns"),
    "two_bodies.csv": (
        f"time,a_pos_x,b_pos_x,y,z,qw,qx,qy,qz\n0,1,{ROWS}\n",
        "'a_pos_x' and 'b_pos_x' both name a column of x; format= may be a list",
    ),
    "no_times.csv": (f"x,y,z,qw,qx,qy,qz\n{ROWS}\n", "the name time. .* Otherwise times= takes"),
    "inches.csv": (f"time,x [in],y [in],z [in],qw,qx,qy,qz\n0,{ROWS}\n", "positions in m, cm or"),
    "minutes.csv": (f"time [min],x,y,z,qw,qx,qy,qz\n0,{ROWS}\n", "times in s, ms, us or ns"),
    "half_of_the_rates.csv": (f"{OWN},wx body [rad/s]\n0,{ROWS},1\n", "the name wy or wz or vx"),
    "names.csv": (f"time,x,y,z,qw,qx,qy\n0,{ROWS}\n", "line 1: 8 names of columns are wanted"),
    "nanoseconds.txt": (f"1403636580838555648 {ROW}\n", "unit='ns' converts"),
    "milliseconds.txt": (f"1403636580838 {ROW}\n", "unit='ms' converts"),
    "relative_ns.txt": ("".join(f"{5000000 * i} {ROW}\n" for i in range(9)), "unit='ns' converts"),
    "near.txt": (f"1403636580.12345678 {ROW}\n1403636580.12345679 {ROW}\n", "start='first'"),
    "boot_clock.txt": (
        "".join(f"{81234567000000 + 50000000 * i} {ROW}\n" for i in range(3)),
        "unit='ns' converts",
    ),
    "whole_ms.txt": ("".join(f"{33 * i} {ROW}\n" for i in range(12)), "unit='ms' converts"),
    "euroc_in_s.csv": (
        f"{EUROC.format('')}\n1403636580.838,{ROWS}\n1403636580.843,{ROWS}\n",
        "in ns, the steps of the times have the median 5e-12 s; unit= gives another unit",
    ),
    "set_back.txt": (
        "".join(f"{t / 10} {ROW}\n" for t in (*range(40), *range(20))),
        "line 41: the time 0.0 is earlier .* the clock was set back, .* split the file",
    ),
    "order_in_words.txt": (
        f"# t p(x,y,z) q(w,x,y,z)\n0 {ROWS.replace(',', ' ')}\n",
        "8 columns are not recognised in 'line 1: t p.*format='tum' reads",
    ),
    **{
        f"order_{k}.txt": (f"# {words}\n0 {ROWS.replace(',', ' ')}\n", "columns are not recogn")
        for k, words in enumerate(("t position quaternion_wxyz", "scalar first", "q (w first)"))
    },
    "nine_columns.txt": (f"# id t x y z qw qx qy\n1 0 {ROW}\n", "9 columns are not recognised in"),
    "only_std.csv": (
        f"t,odom_a,odom_b,odom_c,qw,qx,qy,qz,my_x,my_y\n0,{ROWS},1,2\n",
        "no column has the name x or y or z",
    ),
    "thousands.csv": ("t;x;y;z;qw;qx;qy;qz\n0;1.500;-250,0;750;1;0;0;0\n", "commas and points"),
    "tf.csv": (
        f"t,child_frame_id,{OWN[9:]}\n0,odom,{ROWS}\n1,base,{ROWS}\n",
        r"child_frame_id has several values \(base, odom\)",
    ),
    "dates.csv": (f"{OWN}\n09/26/2011 13:02,{ROWS}\n", "line 2, time.*as in 2026-11-30T10:15:00.5"),
    "no_day.csv": (f"{OWN}\n2011-02-30 13:02:25,{ROWS}\n", "line 2, time.*'2011-02-30 13:02:25'"),
    "stamps.txt": (f"0 {ROW}\n" * 3, "all times are equal"),
    "lost.txt": (f"0 {ROW}\n1 NaN NaN NaN NaN NaN NaN NaN\n", "line 2: .* of x is.*skip='nan'"),
    "angles.csv": ("time,x,y,z,roll,pitch,yaw\n0,1,2,3,0,0,0\n", "no column.*matrix_from_zyx"),
    "vicon.csv": (f"{OWN}\n0,{ROWS}\n1,0,0,0,0,0,0,0\n", "line 3: the quat.* 0.*skip='nan'"),
    "empty_cells.csv": (f"{OWN}\n0,{ROWS}\n1,,,,,,,\n", "line 3: .*skip='nan'"),
    "twice.txt": (f"0 {ROW}\n0.1 {ROW}\n0.10 {ROW}\n", "line 3: .*skip='repeated'"),
    "back.txt": (f"0 {ROW}\n0.2 {ROW}\n0.1 {ROW}\n", "line 3: .*skip='unordered'"),
    "utf_16.csv": (f"{OWN}\n0,{ROWS}\n".encode("utf-16"), "line 1: the text is not in UTF-8"),
    "two_rows.txt": (
        "0 1.5 2.5 3.5 0 0 0.600 0.800\n1 1.5 2.5 3.5 0 0 0.600 0.800",
        "line 2: the line has no line end",
    ),
    "a_few_decimals.txt": (f"0 {ROW}\n" * 3 + f"1 {ROW}", "line 4: the line has no line end"),
    "empty.txt": ("", "no line with numbers"),
}  # fmt: skip


def written(folder, name, text):
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder / name


@pytest.mark.parametrize("name", GOOD)
def test_public_formats_are_read(tmp_path, name):
    text, options, wanted = GOOD[name]
    times, poses, velocities = rb.read_path(written(tmp_path, name, text), **options)
    assert np.abs(poses - P).max() < 1e-15
    assert velocities is None
    assert wanted is None or times.tolist() == wanted


@pytest.mark.parametrize("name", REFUSED)
def test_messages_name_the_file_and_the_next_step(tmp_path, name):
    text, message = REFUSED[name]
    file = written(tmp_path, name, text)
    with pytest.raises(ValueError, match=f"(?s){name}.*{message}"):
        rb.read_path(file)


def test_matrices_that_are_not_rotations_are_refused(tmp_path):
    file = written(tmp_path, "a.txt", KITTI + "1 0 0 0 0 1.01 0 0 0 0 1 0\n")
    with pytest.raises(ValueError, match=r"a\.txt, line 2: a rotation matrix is wanted, got \[\["):
        rb.read_path(file, rate=10)


def test_names_in_any_order_tell_the_columns(tmp_path):
    rng = np.random.default_rng(5)
    names, cells = f"time,x,y,z,qw,qx,qy,qz,extra;0.5,{ROWS},7".split(";")
    for _ in range(20):
        order = rng.permutation(9)
        lines = [",".join(np.array(line.split(","))[order]) for line in (names, cells)]
        times, poses, _ = rb.read_path(written(tmp_path, "a.csv", "\n".join([*lines, ""])))
        assert times == 0.5
        assert np.abs(poses - P).max() < 1e-15


def test_given_names_replace_those_of_the_file(tmp_path):
    names = ["time", "x [mm]", "y [mm]", "z [mm]", "qw", "qx", "qy", "qz"]
    head = "clock,ee_x,ee_y,ee_z,q0,q1,q2,q3,quality\n"
    file = written(tmp_path, "a.csv", f"{head}0,{ROWS},5\n2,{ROWS},6\n")
    times, poses, _ = rb.read_path(file, format=names)
    assert times.tolist() == [0, 2]
    assert np.abs(poses[:, :3, :3] - P[:3, :3]).max() < 1e-15
    assert np.abs(1000 * poses[:, :3, 3] - P[:3, 3]).max() < 1e-15
    rotations = rb.read_path(file, format=["-"] * 4 + names[4:], rate=2)[1]
    assert np.abs(rotations - P[:3, :3]).max() < 1e-15
    for wrong, message in (
        ([*names, "a", "b"], "line 2: 10 columns are wanted for format="),
        (names[:-1], "no column has the name qz"),
        (names[1:], "no column with the name time"),
        ([1, 2], "format: names of columns are wanted"),
    ):
        with pytest.raises(ValueError, match=message):
            rb.read_path(file, format=wrong)


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("form", ["R{}", "r{} [1]", "pose.r_{}"])
def test_names_of_the_entries_of_a_matrix_are_known(tmp_path, form, first):
    indices = range(first, first + 3)
    names = [form.format(f"{i}{j}") for j in indices for i in indices]  # by columns
    numbers = [*P[:3, :3].T.ravel().tolist(), *P[:3, 3].tolist()]
    text = f"t,{','.join(names)},x,y,z\n0,{','.join(map(str, numbers))}\n"
    assert np.abs(rb.read_path(written(tmp_path, "a.csv", text))[1] - P).max() < 1e-15


def test_names_of_all_entries_of_a_pose_are_refused(tmp_path):
    names = [f"r{i}{j}" for i in range(4) for j in range(4)]
    file = written(tmp_path, "a.csv", f"t,{','.join(names)}\n0,{','.join('1' * 16)}\n")
    with pytest.raises(ValueError, match="got r00 and r33; format= may be a list"):
        rb.read_path(file)


def test_times_in_a_second_file_are_exact(tmp_path):
    file = written(tmp_path, "00.txt", KITTI * 3)
    clock = written(tmp_path, "times.txt", "1e9\n1000000000.1\n1000000000.2\n")
    times, *_ = rb.read_path(file, times=clock, start="first")
    assert times.tolist() == [0, 0.1, 0.2]
    with pytest.raises(ValueError, match="times: 3 are wanted, one for each pose, got 2"):
        rb.read_path(file, times=[0, 1])
    with pytest.raises(ValueError, match=r"times.txt, line 2: one time in each line: a finite"):
        rb.read_path(file, times=written(tmp_path, "times.txt", "0\nx\n2\n"))
    with pytest.raises(ValueError, match="times, rate: one of them is wanted, got both"):
        rb.read_path(file, times=clock, rate=3)
    with pytest.raises(ValueError, match=r"times, rate: .*a\.tum has times, in column 1"):
        rb.read_path(written(tmp_path, "a.tum", f"0 {ROW}\n"), rate=3)


def test_relative_times_are_rounded_once(tmp_path):
    """Doubles since 1970 are apart by 2.4e-7 s, which an acceleration at 1 kHz does not survive."""
    stamps = [
        Decimal("1755000000.123456789") + Decimal(i) * Decimal("0.001000001") for i in range(99)
    ]
    for unit, digits in {"s": 0, "ms": 3, "us": 6, "ns": 9}.items():
        text = "".join(f"{stamp.scaleb(digits):f} {ROW}\n" for stamp in stamps)
        file = written(tmp_path, "a.txt", text)
        exact = [float(Fraction(stamp) - Fraction(stamps[0])) for stamp in stamps]
        assert rb.read_path(file, unit=unit, start="first")[0].tolist() == exact
        exact = [float(Fraction(stamp) - 1755000000) for stamp in stamps]
        assert rb.read_path(file, unit=unit, start=1755000000)[0].tolist() == exact
        assert rb.read_path(file, unit=unit)[0].tolist() == list(map(float, stamps))


@pytest.mark.parametrize("names", [OWN, OWN.replace("time [s]", "datetime"), OWN[8:]])
def test_dates_are_exact_seconds_since_1970(tmp_path, names):
    dates = {
        "": None,
        "2026-03-29 01:59:59.123456789": "1774749599.123456789",
        "2026-03-29T03:00:00.5+01:00": "1774749600.5",
        "2026-03-29T02:00:01Z": "1774749601",
        "2026-03-29 04:00:02+0200": "1774749602",
        "NaT": None,
    }
    file = written(tmp_path, "a.csv", "\n".join([names, *(f"{d},{ROWS}" for d in dates)]) + "\n")
    wanted = [Decimal(second) for second in dates.values() if second]
    times, poses, _ = rb.read_path(file, start="first", skip="nan")
    assert times.tolist() == [float(second - wanted[0]) for second in wanted]
    assert np.abs(poses - P).max() < 1e-15
    with pytest.raises(ValueError, match=r"^unit: not with dates, which .*line 2 has"):
        rb.read_path(file, unit="s", skip="nan")
    early = written(tmp_path, "b.csv", f"{names}\n1969-12-31 23:59:58.25,{ROWS}\n")
    assert rb.read_path(early)[0] == [-1.75]


def test_a_last_line_with_as_many_decimals_as_others_needs_no_line_end(tmp_path):
    """A last line that was cut has fewer decimals, or fewer columns."""
    rows = [f"0.{t}00 1.500 -0.250 0.750 0.0000 0.0000 0.6000 0.8000" for t in range(10)]
    text = "\n".join(["# t x y z qx qy qz qw", *rows])
    assert len(rb.read_path(written(tmp_path, "a.txt", text))[0]) == 10
    for lost in range(1, len(rows[-1])):
        with pytest.raises(ValueError, match=r"a\.txt, line 11: "):
            rb.read_path(written(tmp_path, "a.txt", text[:-lost]))


def test_skipped_rows_are_left_out_and_told(tmp_path, caplog):
    lost = "nan nan nan nan nan nan nan"
    rows = [f"0 {lost}", f"1 {ROW}", f"1 {ROW}", f"3 {ROW}", f"2 {ROW}", f"2.5 {ROW}", f"3 {ROW}"]
    file = written(tmp_path, "a.txt", "# here\n" + "\n".join([*rows, f"4 {lost}", f"5 {ROW}", ""]))
    with caplog.at_level(logging.WARNING, logger="rbcourse.files"):
        times, poses, _ = rb.read_path(file, start="first", skip=("repeated", "nan", "unordered"))
    assert times.tolist() == [0, 2, 4]
    assert np.abs(poses - P).max() < 1e-15
    assert [record.getMessage().removeprefix(f"{file}: ") for record in caplog.records] == [
        "left out nan rows (2), in line 2, 9",
        "left out repeated rows (2), in line 4, 8",
        "left out unordered rows (2), in line 6, 7",
    ]
    with pytest.raises(ValueError, match="all times are equal"):
        rb.read_path(written(tmp_path, "b.txt", f"0 {ROW}\n" * 3), skip="repeated")
    for skip in ("nan", ["nan", "unordered"]):
        with pytest.raises(ValueError, match=r"line 4: .*skip='repeated'"):
            rb.read_path(file, skip=skip)
    with pytest.raises(ValueError, match="no row has all its numbers"):
        rb.read_path(written(tmp_path, "b.txt", f"0 {lost}\n"), skip="nan")


def test_rows_are_not_left_out_if_the_clock_is_wrong(tmp_path):
    coarse = [f"{i // 10 / 10} {i}{ROW[1:]}" for i in range(400)]
    with pytest.raises(ValueError, match=r"360 of 400 rows have the time of .* several bodies, or"):
        rb.read_path(written(tmp_path, "a.txt", "\n".join([*coarse, ""])), skip="repeated")
    again = [f"{i // 10 / 10} {i // 10}{ROW[1:]}" for i in range(400)]  # sent ten times
    again = written(tmp_path, "c.txt", "\n".join([*again, ""]))
    assert len(rb.read_path(again, skip="repeated")[0]) == 40
    two = [f"{i // 2 / 100} {i % 2}{ROW[1:]}" for i in range(400)]
    with pytest.raises(ValueError, match=r"200 of 400 rows have the time of .* several bodies, or"):
        rb.read_path(written(tmp_path, "d.txt", "\n".join([*two, ""])), skip="repeated")
    reverse = "".join(f"{4 - i / 100} {ROW}\n" for i in range(400))
    with pytest.raises(ValueError, match=r"line 2: .* or the rows are in another order"):
        rb.read_path(written(tmp_path, "e.txt", reverse))
    first = "".join(f"{i / 100 + 99 * (i == 0)} {ROW}\n" for i in range(400))
    with pytest.raises(ValueError, match=r"line 2: .* the time in line 1 may be wrong; delete"):
        rb.read_path(written(tmp_path, "f.txt", first))
    back = "".join(f"{i / 100 - 0.5 * (i > 200)} {ROW}\n" for i in range(400))
    with pytest.raises(ValueError, match=r"line 202: the clock was set back"):
        rb.read_path(written(tmp_path, "b.txt", back), skip=("unordered", "repeated"))


def test_positions_that_may_be_in_mm_are_told(tmp_path, caplog):
    text = "t,x,y,z,qw,qx,qy,qz\n" + "".join(f"{i / 100},{5 * i},0,0,1,0,0,0\n" for i in range(9))
    rb.read_path(written(tmp_path, "mm.csv", text))
    assert caplog.messages[0].endswith(
        "the median speed is 500 m/s; if the positions are in mm, the names of their columns, or "
        "format=, must have [mm]"
    )
    caplog.clear()
    _, poses, _ = rb.read_path(
        written(tmp_path, "m.csv", text.replace("t,x,y,z", "t,x [mm],y [mm],z [mm]"))
    )
    assert poses[1, 0, 3] == 0.005
    assert not caplog.messages


def test_quaternions_with_too_few_decimals_are_told(tmp_path):
    file = written(tmp_path, "few.txt", "0 0 0 0 0.26 0 0 0.97\n1 0 0 0 0 0 0 1.00\n")
    with pytest.raises(ValueError, match=r"line 1: .* got one of 1.00424; write more decimals"):
        rb.read_path(file)


def test_bad_arguments_are_named(tmp_path):
    file = written(tmp_path, "c.txt", f"0 {ROW}\n")
    for name, values in {
        "start": ("1e999999999", 10**400, np.array([1, 2]), [], "nan", "last"),
        "skip": (None, 1, "late"),
        "format": ("bag",),
        "unit": ("min",),
    }.items():
        for value in values:
            with pytest.raises(ValueError, match=f"^{name}: .* wanted, got"):
                rb.read_path(file, **{name: value})
    for start in (np.int64(2), np.float32(2), np.array(2), 2, "2.0", Decimal(2)):
        assert rb.read_path(file, start=start)[0] == -2
    for wrong in (3, None):
        for call in (rb.read_path, lambda x: rb.write_path(x, [0], P[None])):
            with pytest.raises(ValueError, match=r"^file: a path is wanted, got"):
                call(wrong)
    with pytest.raises(ValueError, match=r"^unit: not with rate"):
        rb.read_path(written(tmp_path, "d.txt", KITTI), rate=3, unit="ms")
    far = written(tmp_path, "far.txt", f"-1.7e308 {ROW}\n1.7e308 {ROW}\n")
    with pytest.raises(ValueError, match=r"far.txt, line 2: the time is too large"):
        rb.read_path(far, start="first", unit="s")
    named = written(tmp_path, "named.txt", f"# t x y z qx qy qz qw\n0 {ROW}\n")
    assert rb.read_path(named, format="tum")[0] == 0
    with pytest.raises(ValueError, match=r"^format: .*has names of columns, in another order"):
        rb.read_path(named, format="csv")


def test_a_curve_is_written_with_its_velocities_and_accelerations(tmp_path):
    ends = rb.pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0.3, -1, 2, 1, 2, 3]])
    t = np.linspace(0, 2, 21)
    for path in (ends, ends[:, :3, :3]):
        curve = rb.projected_spline([0, 2], path, "rest")
        rb.write_path(tmp_path / "a.csv", t, curve)
        names = (tmp_path / "a.csv").read_text("utf-8").splitlines()[0].split(",")
        table = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
        columns = dict(zip(names, table.T, strict=True))
        size = curve.size == 4
        for order, (letters, units) in {
            1: ("wv", ("rad/s", "m/s")),
            2: (["alpha", "a"], ("rad/s^2", "m/s^2")),
        }.items():
            for kind in range(1 + size):
                of = curve(t, order)[:, 3 * kind : 3 * kind + 3]
                for axis, x in zip("xyz", of.T, strict=True):
                    assert np.array_equal(columns[f"{letters[kind]}{axis} body [{units[kind]}]"], x)
        times, poses, velocities = rb.read_path(tmp_path / "a.csv")
        assert np.array_equal(times, t)
        assert np.abs(poses - curve(t)).max() < 1e-14
        assert np.array_equal(velocities, curve(t, 1))
    curve = rb.projected_spline([0, 2], ends, "rest")
    rb.write_path(tmp_path / "a.tum", t, curve)
    assert np.abs(rb.read_path(tmp_path / "a.tum")[1] - curve(t)).max() < 1e-14
    stack = rb.geodesic(ends[:1], ends)
    for arguments, message in (
        ((t, curve, t), "velocities, accelerations: those of the curve"),
        (([0, 3], curve), r"t\[1\] is 3.0, a time in"),
        ((t, stack), r"path: a single curve is wanted, got a stack"),
        (([0, 1], ends, None, np.zeros((2, 6))), "accelerations: they need velocities"),
        (([0, 1], ends, np.zeros((2, 6)), np.zeros((3, 6))), "accelerations: 2 are wanted"),
        (([0, 1], ends, np.zeros((2, 6)), np.zeros((2, 3))), "accelerations: shape"),
    ):
        with pytest.raises(ValueError, match=f"^{message}"):
            rb.write_path(tmp_path / "b.csv", *arguments)
        assert not (tmp_path / "b.csv").exists()


def four_rows(folder, names, first="{t}"):
    """Write four poses; `first` is the form of the cells before the position."""
    cells = [first.format(i=i, t=0.5 * i, half=i // 2) for i in range(4)]
    rows = [f"{cell},1,2,3,0.5,0.5,0.5,0.5" for cell in cells]
    return written(folder, "four.csv", "\n".join([names, *rows, ""]))


@pytest.mark.parametrize(
    ("names", "stamp", "message"),
    [
        ("time,nanoseconds", "1500000000", "nanoseconds below 1e9, are wanted"),
        ("time,nsec", "0", "whole seconds"),
        ("t,id", "{half}", "id has several values"),
        ("sec,usec", "900000", "usec may be a part of the time"),
        ("secs,msec", "5", "msec may be a part"),
        ("min,sec", "5", "min may be a part"),
    ],
)
def test_columns_that_contradict_each_other_are_refused(tmp_path, names, stamp, message):
    file = four_rows(tmp_path, f"{names},x,y,z,qw,qx,qy,qz", f"{{t}},{stamp}")
    with pytest.raises(ValueError, match=message):
        rb.read_path(file)


@pytest.mark.parametrize(
    ("name", "cells", "accepted"),
    [
        ("tracker", ["A", "B"], False),
        ("rigid_body", ["head", "hand", "hand"], False),
        ("marker_id", ["7", "3"], False),
        ("satellites", ["7", "8"], True),
        ("state", ["OK"] * 20 + ["LOST"] * 5, True),
        ("note", [f"row{i}" for i in range(60)], True),
        ("marker_id", ["7"], True),
        ("keyframe", ["true", "false"], True),
        ("-", ["A", "B"], True),
    ],
)
def test_rows_of_two_bodies_in_turn_are_refused(tmp_path, name, cells, accepted):
    rows = [f"{i / 100},{ROWS},{cells[i % len(cells)]}" for i in range(60)]
    file = written(tmp_path, "a.csv", "\n".join([f"{OWN},{name}", *rows, ""]))
    if accepted:
        assert len(rb.read_path(file)[0]) == 60
        return
    with pytest.raises(
        ValueError, match=rf"'{name}' changes between a few values \({min(cells)}, "
    ):
        rb.read_path(file)


def test_one_time_that_is_far_ahead_is_named(tmp_path):
    rows = [f"{i / 100 + 3600 * (i == 50)} {ROW}" for i in range(200)]
    file = written(tmp_path, "a.txt", "\n".join([*rows, ""]))
    with pytest.raises(ValueError, match="the time in line 51 may be wrong; delete this line"):
        rb.read_path(file)


@pytest.mark.parametrize(
    "names",
    [
        "head_pos_x,head_pos_y,head_pos_z,hand_rot_w,hand_rot_x,hand_rot_y,hand_rot_z",
        "a_pos_x,a_pos_y,b_pos_z,qw,qx,qy,qz",
        "target.position.x,target.position.y,target.position.z,pose.orientation.w,"
        "tool.orientation.x,tool.orientation.y,tool.orientation.z",
        "p_WC_x,p_WC_y,p_WC_z,q_CW_w,q_CW_x,q_CW_y,q_CW_z",
    ],
)
def test_numbers_of_two_bodies_are_not_one_pose(tmp_path, names):
    with pytest.raises(ValueError, match="may be of two bodies or frames"):
        rb.read_path(four_rows(tmp_path, f"time,{names}"))


@pytest.mark.parametrize("name", ["id", "latency_ms", "exposure_us"])
def test_a_number_that_counts_or_measures_a_row_is_no_body_and_no_time(tmp_path, name):
    file = four_rows(tmp_path, f"{name},time,x,y,z,qw,qx,qy,qz", "{i},{t}")
    assert rb.read_path(file)[0].tolist() == [0, 0.5, 1, 1.5]


@pytest.mark.parametrize("step", ["10.0", "8.333", "4", "1.0"])
def test_steps_of_a_second_or_more_need_a_unit(tmp_path, step):
    """In seconds since 1970, such steps are those of keyframes."""
    file, rows = tmp_path / "slow.txt", [f"{i * float(step)!r} 1 2 3 0 0 0 1" for i in range(12)]
    file.write_text("\n".join([*rows, ""]))
    with pytest.raises(ValueError, match=r"unit='ms'.* unit='s' reads them as they are"):
        rb.read_path(file)
    assert rb.read_path(file, unit="ms")[0][1] == pytest.approx(float(step) / 1e3)
    assert rb.read_path(file, unit="s")[0][1] == pytest.approx(float(step))
    rows = [f"{1.7e9 + i * float(step)!r} 1 2 3 0 0 0 1" for i in range(12)]
    file.write_text("\n".join([*rows, ""]))
    assert rb.read_path(file, start="first")[0][1] == pytest.approx(float(step))


@pytest.mark.parametrize(
    "names", ["xpos,ypos,zpos", "posXm,posYm,posZm", "x1,y1,z1", "CameraX,CameraY,CameraZ"]
)
def test_positions_with_other_names_are_not_dropped(tmp_path, names):
    with pytest.raises(ValueError, match="no column has the name x or y or z"):
        rb.read_path(four_rows(tmp_path, f"time,{names},qw,qx,qy,qz"))


def test_columns_that_are_not_read_are_named_if_there_is_no_position(tmp_path, caplog):
    for names, said in (("north,east,down", True), ("AccX,accY,acc_z", False)):
        poses = rb.read_path(four_rows(tmp_path, f"time,{names},qw,qx,qy,qz"))[1]
        assert poses.shape == (4, 3, 3)
        assert ("not read: north, east, down" in caplog.text) == said
        caplog.clear()


def test_a_given_unit_replaces_that_of_the_name(tmp_path):
    file = written(tmp_path, "a.csv", f"{OWN.replace('time [s]', 't [1]')}\n0.5,{ROWS}\n")
    assert rb.read_path(file, unit="s")[0] == [0.5]
    with pytest.raises(ValueError, match="got '1'; unit= gives the unit"):
        rb.read_path(file)


@pytest.mark.parametrize("units", ["[s],[mm],[mm],[mm],[1],[1],[1],[1]", "s,mm,mm,mm,-,-,-,-"])
def test_quaternions_may_have_the_unit_1(units, tmp_path):
    file = tmp_path / "units.csv"
    file.write_text(f"time,x,y,z,qw,qx,qy,qz\n{units}\n0.0,1,2,3,.5,.1,.7,.5\n", "utf-8")
    np.testing.assert_allclose(rb.read_path(file)[1][0, :3, 3], [1e-3, 2e-3, 3e-3])


def test_the_columns_of_a_written_curve_are_known(tmp_path, caplog):
    rb.write_path(tmp_path / "turn.csv", [0, 1], rb.geodesic(np.eye(3), rb.exp_so3([0, 0, 1])))
    rb.read_path(tmp_path / "turn.csv")
    assert caplog.text == ""
