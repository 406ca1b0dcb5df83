#!/usr/bin/env python3
"""Logs of one run in every format, for tests/all/formats.rs, written by the tools that people write them with.

    pip install mcap mcap-ros2-support rosbags h5py scipy pyarrow numpy
    python make.py        (writes beside this script)
"""

import gzip
import json
import pathlib
import shutil
import sqlite3

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import StoragePlugin, Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_typestore

HERE = pathlib.Path(__file__).resolve().parent
JOINTS = ["shoulder", "elbow"]
COUNT = 60
TIME = np.arange(COUNT) / 128  # exact in binary: the same numbers in every format
POSITION = np.stack([np.sin(3 * TIME), np.cos(2 * TIME)], axis=1)
VELOCITY = np.stack([3 * np.cos(3 * TIME), -2 * np.sin(2 * TIME)], axis=1)
EFFORT = np.stack([5 * np.sin(4 * TIME) + 1, 2 * np.cos(5 * TIME)], axis=1)
COMMAND = POSITION + 0.01
START = 1_700_000_000_000_000_000  # ns since 1970

DEFINITIONS = {
    "sensor_msgs/msg/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
    "control_msgs/msg/JointTrajectoryControllerState": "std_msgs/Header header\nstring[] joint_names\n"
    + "".join(f"trajectory_msgs/JointTrajectoryPoint {p}\n" for p in ["reference", "feedback", "error", "output"]),
    "control_msgs/msg/Former": "std_msgs/Header header\nstring[] joint_names\n"
    + "".join(f"trajectory_msgs/JointTrajectoryPoint {p}\n" for p in ["desired", "actual", "error"]),
    "control_msgs/msg/DynamicJointState": "std_msgs/Header header\nstring[] joint_names\nInterfaceValue[] interface_values\n",
}
PARTS = (
    "================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    "================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    "================\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n"
    "================\nMSG: trajectory_msgs/JointTrajectoryPoint\nfloat64[] positions\nfloat64[] velocities\n"
    "float64[] accelerations\nfloat64[] effort\nbuiltin_interfaces/Duration time_from_start\n"
    "================\nMSG: control_msgs/InterfaceValue\nstring[] interface_names\nfloat64[] values\n"
)


def csv():
    names = ["time"] + [f"{c}.{j}" for c in ["position", "velocity", "effort", "command"] for j in JOINTS]
    table = np.column_stack([TIME, POSITION, VELOCITY, EFFORT, COMMAND])
    cells = [[repr(float(x)) for x in row] for row in table]
    (HERE / "run.csv").write_text("\n".join([",".join(names)] + [",".join(row) for row in cells]) + "\n")
    # What loggers do: comments, another order of columns, a row of units, a comma at the end of each row, ms.
    order = [5, 6, 0, 1, 2, 3, 4]
    units = ["ms", "rad", "rad", "rad/s", "rad/s", "N m", "N m"]
    head = ["time"] + names[1:7]
    lines = ["# logger 1.2", "# robot: two links", ",".join(head[i] for i in order) + ","]
    lines.append(",".join(units[i] for i in order) + ",")
    for row, t in zip(cells, TIME):
        row = [repr(float(1000 * t))] + row[1:]
        lines.append(",".join(row[i] for i in order) + ",")
    (HERE / "logger.csv").write_text("\n".join(lines) + "\n")
    lines = [";".join(["time_ns"] + names[1:7])]
    for row, t in zip(cells, TIME):
        lines.append(";".join([str(START + round(t * 1e9))] + [cell.replace(".", ",") for cell in row[1:7]]))
    (HERE / "european.csv").write_text("\n".join(lines) + "\n", encoding="utf-8-sig")


def arrays():
    np.savez(HERE / "run.npz", time=TIME, position=POSITION, velocity=VELOCITY, effort=EFFORT, joint_names=JOINTS)
    np.savez_compressed(HERE / "plain.npz", q=np.asfortranarray(POSITION), qd=VELOCITY, tau=EFFORT, dt=1 / 128)
    np.save(HERE / "table.npy", np.column_stack([TIME, POSITION, VELOCITY, EFFORT]))
    scipy.io.savemat(HERE / "run.mat", {"t": TIME, "q": POSITION, "qd": VELOCITY, "tau": EFFORT}, do_compression=True)
    log = {"time": TIME[:, None], "position": POSITION.T, "velocity": VELOCITY.T, "effort": EFFORT.T}
    log["joint_names"] = np.array(JOINTS, dtype=object)
    scipy.io.savemat(HERE / "struct.mat", {"log": log, "comment": "two links"})
    with h5py.File(HERE / "aloha.hdf5", "w") as file:
        file.attrs["sim"] = False
        seen = file.create_group("observations")
        for name, values in [("qpos", POSITION), ("qvel", VELOCITY), ("effort", EFFORT)]:
            seen.create_dataset(name, data=values)
        seen.create_group("images").create_dataset(
            "top", data=np.zeros((COUNT, 2, 2, 3), np.uint8), chunks=(1, 2, 2, 3), compression="gzip"
        )
        file.create_dataset("action", data=COMMAND, chunks=(16, 2), compression="gzip")


def parquet():
    flat = {"time": TIME}
    for name, values in [("position", POSITION), ("velocity", VELOCITY), ("effort", EFFORT)]:
        flat |= {f"{name}.{joint}": values[:, at] for at, joint in enumerate(JOINTS)}
    pq.write_table(pa.table(flat), HERE / "flat.parquet", row_group_size=25)
    nested = {"timestamp": TIME, "q": list(POSITION), "dq": list(VELOCITY), "tau": list(EFFORT)}
    pq.write_table(pa.table(nested), HERE / "nested.parquet", compression="gzip")


def stamp(k, late=0):
    ns = START + round(TIME[k] * 1e9) - late
    return {"sec": ns // 10**9, "nanosec": ns % 10**9}


def header(k):
    return {"stamp": stamp(k), "frame_id": ""}


def joint_state(k, joints=(0, 1), effort=True):
    joints = list(joints)
    return {
        "header": header(k),
        "name": [JOINTS[j] for j in joints],
        "position": POSITION[k, joints].tolist(),
        "velocity": VELOCITY[k, joints].tolist(),
        "effort": EFFORT[k, joints].tolist() if effort else [],
    }


def point(positions=(), velocities=(), effort=()):
    duration = {"sec": 0, "nanosec": 0}
    lists = {"positions": positions, "velocities": velocities, "accelerations": [], "effort": effort}
    return {name: list(values) for name, values in lists.items()} | {"time_from_start": duration}


def mcap(name, messages, compression=CompressionType.ZSTD):
    """Writes `(topic, type, message, ns after its stamp)`."""
    with open(HERE / name, "wb") as file:
        writer = McapWriter(file, chunk_size=4000, compression=compression)
        schemas = {}
        for topic, kind, message, late in messages:
            if kind not in schemas:
                written = kind.replace("Former", "JointTrajectoryControllerState")
                schemas[kind] = writer.register_msgdef(written, DEFINITIONS[kind] + PARTS)
            when = message["header"]["stamp"]
            ns = START if when["sec"] == 0 else when["sec"] * 10**9 + when["nanosec"]
            writer.write_message(topic=topic, schema=schemas[kind], message=message, log_time=ns + late)
        writer.finish()


def mcaps():
    state, control = "sensor_msgs/msg/JointState", "control_msgs/msg/JointTrajectoryControllerState"
    plain = [("/joint_states", state, joint_state(k), 1000) for k in range(COUNT)]
    mcap("zstd.mcap", plain)
    mcap("lz4.mcap", plain, CompressionType.LZ4)
    mcap("none.mcap", plain, CompressionType.NONE)
    both = []
    for k in range(COUNT):
        both.append(("/joint_states", state, joint_state(k), 1000))
        message = {"header": header(k), "joint_names": JOINTS, "reference": point(COMMAND[k]), "error": point(), "output": point()}
        message["feedback"] = point(POSITION[k], VELOCITY[k])
        both.append(("/arm_controller/controller_state", control, message, 1000))
    mcap("control.mcap", both)
    former = []
    for k in range(COUNT):
        message = {"header": header(k), "joint_names": JOINTS, "desired": point(COMMAND[k]), "error": point()}
        message["actual"] = point(POSITION[k], VELOCITY[k], EFFORT[k])
        former.append(("/arm_controller/state", "control_msgs/msg/Former", message, 1000))
    mcap("former.mcap", former)
    dynamic = []
    for k in range(COUNT):
        values = [
            {"interface_names": ["effort", "position", "velocity"], "values": [EFFORT[k, j], POSITION[k, j], VELOCITY[k, j]]}
            for j in range(2)
        ]
        message = {"header": header(k), "joint_names": JOINTS, "interface_values": values}
        dynamic.append(("/dynamic_joint_states", "control_msgs/msg/DynamicJointState", message, 1000))
    mcap("dynamic.mcap", dynamic)
    # A gripper publishes on the same topic, and the names change their order.
    publishers = []
    for k in range(COUNT):
        publishers.append(("/joint_states", state, joint_state(k, (0, 1) if k % 2 else (1, 0)), 1000))
        grip = {"header": header(k), "name": ["gripper"], "position": [0.0], "velocity": [], "effort": []}
        publishers.append(("/joint_states", state, grip, 1000))
    mcap("publishers.mcap", publishers)
    two = [(f"/{robot}/joint_states", state, joint_state(k), 1000) for k in range(COUNT) for robot in ["left", "right"]]
    mcap("two_robots.mcap", two)
    unstamped = []
    for k in range(COUNT):
        message = joint_state(k) | {"header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}}
        unstamped.append(("/joint_states", state, message, round(TIME[k] * 1e9)))
    mcap("unstamped.mcap", unstamped)
    mcap("no_effort.mcap", [("/joint_states", state, joint_state(k, effort=False), 0) for k in range(COUNT)])
    late = [("/joint_states", state, joint_state(k), 1000 + 10**7 * k) for k in range(COUNT)]
    mcap("late.mcap", late)


def bags():
    for name, storage in [("bag_sqlite", StoragePlugin.SQLITE3), ("bag_mcap", StoragePlugin.MCAP)]:
        shutil.rmtree(HERE / name, ignore_errors=True)
        types = get_typestore(Stores.ROS2_HUMBLE)
        kinds = types.types
        with Rosbag2Writer(HERE / name, version=9, storage_plugin=storage) as bag:
            link = bag.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=types)
            for k in range(COUNT):
                time = kinds["builtin_interfaces/msg/Time"](**stamp(k))
                head = kinds["std_msgs/msg/Header"](stamp=time, frame_id="")
                message = kinds["sensor_msgs/msg/JointState"](
                    header=head, name=JOINTS, position=POSITION[k], velocity=VELOCITY[k], effort=EFFORT[k]
                )
                raw = types.serialize_cdr(message, "sensor_msgs/msg/JointState")
                bag.write(link, START + round(TIME[k] * 1e9), raw)
    types = get_typestore(Stores.ROS1_NOETIC)
    (HERE / "ros1.bag").unlink(missing_ok=True)
    with Rosbag1Writer(HERE / "ros1.bag") as bag:
        bag.add_connection("/clock", "std_msgs/msg/Float64", typestore=types)


def lerobot():
    """Two episodes to the documented layout of either version."""
    for version in ["v2.1", "v3.0"]:
        root = HERE / f"lerobot_{version.replace('.', '')}"
        shutil.rmtree(root, ignore_errors=True)
        (root / "meta").mkdir(parents=True)
        names = [f"{joint}.pos" for joint in JOINTS] if version == "v3.0" else {"motors": JOINTS}
        vector = {"dtype": "float32", "shape": [2], "names": names}
        scalar = {"shape": [1], "names": None}
        features = {"observation.state": vector, "observation.effort": vector, "action": vector}
        features["observation.images.top"] = {"dtype": "video", "shape": [480, 640, 3], "names": ["height", "width", "channel"]}
        features |= {"timestamp": {"dtype": "float32"} | scalar}
        features |= {key: {"dtype": "int64"} | scalar for key in ["frame_index", "episode_index", "index", "task_index"]}
        path = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
        if version == "v3.0":
            path = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
        info = {"codebase_version": version, "robot_type": "two_links", "total_episodes": 2, "total_frames": 2 * COUNT}
        info |= {"fps": 128, "data_path": path, "features": features}
        (root / "meta/info.json").write_text(json.dumps(info, indent=1) + "\n")
        tables = []
        for episode in range(2):
            single = lambda values: pa.array(list((values + episode).astype(np.float32)), pa.list_(pa.float32(), 2))
            tables.append(
                pa.table(
                    {
                        "observation.state": single(POSITION),
                        "observation.effort": single(EFFORT),
                        "action": single(COMMAND),
                        "timestamp": TIME.astype(np.float32),
                        "frame_index": np.arange(COUNT),
                        "episode_index": np.full(COUNT, episode),
                        "index": np.arange(COUNT) + episode * COUNT,
                        "task_index": np.zeros(COUNT, int),
                    }
                )
            )
        data = root / "data/chunk-000"
        data.mkdir(parents=True)
        if version == "v3.0":
            pq.write_table(pa.concat_tables(tables), data / "file-000.parquet", row_group_size=70)
        else:
            for episode, table in enumerate(tables):
                pq.write_table(table, data / f"episode_{episode:06d}.parquet")


def dataset(root, version, features, tables, robot_type="two_links"):
    """A LeRobot folder whose features of numbers hold two joints each; `tables` is a list of episodes."""
    shutil.rmtree(root, ignore_errors=True)
    (root / "meta").mkdir(parents=True)
    vector = {"dtype": "float32", "shape": [2], "names": [f"{joint}.pos" for joint in JOINTS]}
    described = {name: vector for name in features} | {"timestamp": {"dtype": "float32", "shape": [1], "names": None}}
    described |= {"episode_index": {"dtype": "int64", "shape": [1], "names": None}}
    info = {"codebase_version": version, "robot_type": robot_type, "fps": 128, "features": described}
    (root / "meta/info.json").write_text(json.dumps(info, indent=1) + "\n")
    whole = []
    for episode, table in enumerate(tables):
        count = len(table[features[0]])
        columns = {name: pa.array(list(table[name].astype(np.float32)), pa.list_(pa.float32(), 2)) for name in features}
        columns |= {"timestamp": (np.arange(count) / 128).astype(np.float32), "episode_index": np.full(count, episode)}
        whole.append(pa.table(columns))
    (root / "data/chunk-000").mkdir(parents=True)
    pq.write_table(pa.concat_tables(whole), root / "data/chunk-000/file-000.parquet", compression="gzip")


def without_torque():
    """The run without its torque: set points say what drives the joints."""
    state, control = "sensor_msgs/msg/JointState", "control_msgs/msg/JointTrajectoryControllerState"
    both = []
    for k in range(COUNT):
        both.append(("/joint_states", state, joint_state(k, effort=False), 1000))
        message = {"header": header(k), "joint_names": JOINTS, "error": point(), "output": point(), "feedback": point()}
        both.append(("/controller/state", control, message | {"reference": point(COMMAND[k])}, 1000))
    mcap("set_points.mcap", both)
    np.savez_compressed(HERE / "set_points.npz", time=TIME, qpos=POSITION, action=COMMAND, joint_names=JOINTS)
    scipy.io.savemat(HERE / "set_points.mat", {"t": TIME, "q": POSITION, "qdes": COMMAND}, do_compression=True)
    with h5py.File(HERE / "set_points.hdf5", "w") as file:
        file.create_group("observations").create_dataset("qpos", data=POSITION)
        file.create_dataset("action", data=COMMAND)
    nested = {"timestamp": TIME, "q": list(POSITION), "command": list(COMMAND)}
    pq.write_table(pa.table(nested), HERE / "set_points.parquet", compression="gzip")
    degrees = {"observation.state": np.degrees(POSITION) + 90, "action": np.degrees(COMMAND) + 90}
    degrees["observation.motor_currents"] = EFFORT
    dataset(HERE / "lerobot_set_points", "v3.0", list(degrees), [degrees], "so101_follower")


def broken():
    """Files that their tools write and that hold no run."""
    folder = HERE / "broken"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    ragged = [list(row)[: 1 + (k != 40)] for k, row in enumerate(POSITION)]
    pq.write_table(pa.table({"time": TIME, "q": ragged, "tau": list(EFFORT)}), folder / "ragged.parquet")
    holes = EFFORT.copy()
    holes[7, 1] = np.nan
    pq.write_table(pa.table({"time": TIME, "q": list(POSITION), "tau": list(holes)}), folder / "nan.parquet")
    pq.write_table(pa.table({"name": ["a"], "note": ["b"]}), folder / "texts.parquet")
    np.savez(folder / "objects.npz", time=np.array([object()], dtype=object))
    np.savez(folder / "lengths.npz", time=TIME[:-1], q=POSITION, tau=EFFORT)
    np.savez(folder / "no_time.npz", q=POSITION, tau=EFFORT)
    np.savez(folder / "rate.npz", q=POSITION, tau=EFFORT, rate=0.0)
    np.savez(folder / "empty.npz", time=TIME[:0], q=POSITION[:0], tau=EFFORT[:0])
    np.save(folder / "records.npy", np.zeros(3, dtype=[("a", "f8"), ("b", "i4")]))
    scipy.io.savemat(folder / "strings.mat", {"note": "nothing"})
    with h5py.File(folder / "nothing.hdf5", "w") as file:
        file.create_group("observations")
    state = "sensor_msgs/msg/JointState"
    twice = joint_state(0) | {"name": ["elbow", "elbow"]}
    mcap("broken/twice.mcap", [("/joint_states", state, twice, 0)])
    others = [("/joint_states", state, joint_state(k) | {"name": ["a", "b"]}, 0) for k in range(COUNT)]
    mcap("broken/others.mcap", others)
    short = joint_state(0) | {"position": [1.0]}
    mcap("broken/short.mcap", [("/joint_states", state, short, 0)])
    with sqlite3.connect(folder / "schema.db3") as base:
        base.execute("CREATE TABLE topics (id INTEGER, name TEXT)")
    run = {"observation.state": POSITION, "observation.effort": EFFORT}
    dataset(folder / "no_drive", "v3.0", ["observation.state"], [run])
    dataset(folder / "no_episodes", "v3.0", list(run), [{name: values[:0] for name, values in run.items()}])
    dataset(folder / "widths", "v3.0", list(run), [run])
    text = (folder / "widths/meta/info.json").read_text()
    (folder / "widths/meta/info.json").write_text(text.replace("2\n", "3\n"))


def same():
    """One run of an arm with friction that its URDF lacks, in every container, for the command's tests: its diagnosis is one."""
    folder = HERE / "same"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    time = np.arange(768) / 128
    # Axes are vertical and the lower link's centre lies on its axis: torques by hand.
    a, b = [1.1, 2.3, 4.1], [1.7, 2.9, 5.3]
    position = np.stack([sum(0.3 * np.sin(w * time + w) for w in a), sum(0.3 * np.cos(w * time) for w in b)], axis=1)
    velocity = np.stack([sum(0.3 * w * np.cos(w * time + w) for w in a), -sum(0.3 * w * np.sin(w * time) for w in b)], axis=1)
    speed_up = np.stack([-sum(0.3 * w * w * np.sin(w * time + w) for w in a), -sum(0.3 * w * w * np.cos(w * time) for w in b)], axis=1)
    upper, lower = 0.05, 0.02
    effort = np.stack([(upper + lower) * speed_up[:, 0] + lower * speed_up[:, 1], lower * speed_up.sum(axis=1)], axis=1)
    effort += 0.4 * velocity
    names = ["time"] + [f"{c}.{j}" for c in ["position", "effort"] for j in JOINTS]
    table = np.column_stack([time, position, effort])
    text = "\n".join([",".join(names)] + [",".join(repr(float(x)) for x in row) for row in table]) + "\n"
    with gzip.open(folder / "run.csv.gz", "wb") as file:
        file.write(text.encode())
    np.savez_compressed(folder / "run.npz", time=time, position=position, effort=effort, joint_names=JOINTS)
    np.save(folder / "run.npy", table)
    scipy.io.savemat(folder / "run.mat", {"t": time, "q": position, "tau": effort}, do_compression=True)
    with h5py.File(folder / "run.hdf5", "w") as file:
        for name, values in [("time", time), ("qpos", position), ("effort", effort)]:
            file.create_dataset(name, data=values, compression="gzip")
    nested = {"time": time, "q": list(position), "tau": list(effort)}
    pq.write_table(pa.table(nested), folder / "run.parquet", compression="gzip")
    types = get_typestore(Stores.ROS2_HUMBLE)
    kinds, state = types.types, "sensor_msgs/msg/JointState"
    messages = []
    for k, t in enumerate(time):
        ns = START + round(t * 1e9)
        stamp = {"sec": ns // 10**9, "nanosec": ns % 10**9}
        numbers = {"name": JOINTS, "position": position[k], "velocity": np.zeros(0), "effort": effort[k]}
        messages.append((ns, stamp, numbers))
    lists = lambda numbers: {name: list(values) for name, values in numbers.items()}
    mcap("same/run.mcap", [("/joint_states", state, {"header": {"stamp": s, "frame_id": ""}} | lists(n), 0) for _, s, n in messages])
    with Rosbag2Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
        link = bag.add_connection("/joint_states", state, typestore=types)
        for ns, s, numbers in messages:
            head = kinds["std_msgs/msg/Header"](stamp=kinds["builtin_interfaces/msg/Time"](**s), frame_id="")
            bag.write(link, ns, types.serialize_cdr(kinds[state](header=head, **numbers), state))
    for version in ["v2.1", "v3.0"]:
        root = folder / f"lerobot_{version.replace('.', '')}"
        dataset(root, version, ["observation.state", "observation.effort"], [{"observation.state": position, "observation.effort": effort}])
        if version == "v2.1":
            (root / "data/chunk-000/file-000.parquet").rename(root / "data/chunk-000/episode_000000.parquet")


if __name__ == "__main__":
    csv()
    arrays()
    parquet()
    mcaps()
    bags()
    lerobot()
    without_torque()
    broken()
    same()
