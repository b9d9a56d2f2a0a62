"""Reads a data set with pyarrow and compares it with what is expected: check.py SET EXPECTED.json"""
import json
import math
import pathlib
import sys

import pyarrow as pa
import pyarrow.parquet as pq

ROOT = pathlib.Path(sys.argv[1])
EXPECTED = json.loads(pathlib.Path(sys.argv[2]).read_text())
EPISODES = EXPECTED["episodes"]
IMAGE, KEYPOINTS = "observation.images.left", "observation.keypoints"
STATISTICS = ["min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99"]


def same(what, found, expected, tolerance=0.0):
    """Compares numbers, texts and lists of them; None stands for NaN."""
    if isinstance(expected, (list, tuple)):
        assert len(found) == len(expected), f"{what}: {len(found)} instead of {len(expected)}"
        for i, pair in enumerate(zip(found, expected)):
            same(f"{what}[{i}]", *pair, tolerance)
    elif expected is None:
        numbers = found if isinstance(found, list) else [found]
        assert all(x is None or math.isnan(x) for x in numbers), f"{what}: {found}"
    elif isinstance(expected, float):
        assert abs(found - expected) <= tolerance, f"{what}: {found} instead of {expected}"
    else:
        assert found == expected, f"{what}: {found!r} instead of {expected!r}"


def statistics(values):
    """Those of a list of numbers, in the order of STATISTICS."""
    values = sorted(v for v in values if not math.isnan(v))
    mean = math.fsum(values) / len(values)
    std = math.sqrt(math.fsum((v - mean) ** 2 for v in values) / len(values))
    quantiles = []
    for part in (0.01, 0.10, 0.50, 0.90, 0.99):
        place = part * (len(values) - 1)
        below, above = values[math.floor(place)], values[math.ceil(place)]
        quantiles.append(below + (place - math.floor(place)) * (above - below))
    return [values[0], values[-1], mean, std, *quantiles]


def layout():
    """Files and what info.json tells of them."""
    files = sorted(str(p.relative_to(ROOT)) for p in ROOT.rglob("*") if p.is_file())
    same("files", files, [
        "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet",
        "meta/info.json", "meta/stats.json", "meta/tasks.parquet", "meta/wag.json",
    ])
    info = json.loads((ROOT / "meta/info.json").read_text())
    frames = sum(len(e["frames"]) for e in EPISODES)
    width, height = EXPECTED["size_px"]
    for key, value in {
        "codebase_version": "v3.0", "fps": EXPECTED["fps"], "total_episodes": len(EPISODES),
        "total_frames": frames, "total_tasks": len(EXPECTED["tasks"]), "video_path": None,
        "splits": {"train": f"0:{len(EPISODES)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
    }.items():
        same(key, info[key], value)
    image = {"dtype": "image", "shape": [height, width, 3], "names": ["height", "width", "channels"]}
    same(IMAGE, info["features"][IMAGE], image)
    for key in ("observation.state", "action"):
        same(key, info["features"][key]["shape"], [7])
    return info


def schema(table, info):
    """Columns are those of info.json, with the types that the library makes of them."""
    kinds = {"float32": pa.float32(), "int64": pa.int64()}
    same("columns", sorted(table.column_names), sorted(info["features"]))
    for name, feature in info["features"].items():
        if feature["dtype"] == "image":
            kind = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
        else:
            kind = kinds[feature["dtype"]]
            for _ in feature["shape"] if feature["shape"] != [1] else []:
                kind = pa.list_(pa.field("element", kind))
        same(name, table.schema.field(name).type, kind)
    told = json.loads(table.schema.metadata[b"huggingface"])["info"]["features"]
    same("features of datasets", sorted(told), sorted(info["features"]))
    same(IMAGE, told[IMAGE], {"_type": "Image"})
    same("state", told["action"], {"feature": {"dtype": "float32", "_type": "Value"}, "length": 7, "_type": "List"})
    same(KEYPOINTS, told[KEYPOINTS], {"shape": [3, 2], "dtype": "float32", "_type": "Array2D"})


def frames(rows):
    """Every value of every frame."""
    index = 0
    for number, episode in enumerate(EPISODES):
        for frame, expected in enumerate(episode["frames"]):
            row, at = rows[index], f"episode {number}, frame {frame}"
            same(f"{at}: index", row["index"], index)
            same(f"{at}: frame_index", row["frame_index"], frame)
            same(f"{at}: episode_index", row["episode_index"], number)
            same(f"{at}: task_index", row["task_index"], number)
            same(f"{at}: timestamp", row["timestamp"], frame / EXPECTED["fps"], 1e-6)
            same(f"{at}: state", row["observation.state"], expected["state"], 1e-6)
            same(f"{at}: action", row["action"], expected["action"], 1e-6)
            same(f"{at}: keypoints", row[KEYPOINTS], expected["keypoints"], 1e-5)
            image = pathlib.Path(expected["picture"]).read_bytes()
            assert row[IMAGE]["bytes"] == image, f"{at}: another picture than {expected['picture']}"
            same(f"{at}: path", row[IMAGE]["path"], f"frame-{frame:06d}.jpg")
            index += 1
    same("rows", len(rows), index)


def values_of(name, rows):
    """Lists of values of which each has statistics, and how many rows have any."""
    if name == KEYPOINTS:
        there = [r[name] for r in rows if not math.isnan(r[name][0][0])]
        return [[p[k] for points in there for p in points] for k in (0, 1)], len(there)
    if isinstance(rows[0][name], list):
        return list(zip(*(r[name] for r in rows))), len(rows)
    return [[float(r[name]) for r in rows]], len(rows)


def check_statistics(what, told, rows, expected):
    """Statistics that the set tells of some rows."""
    for name in rows[0]:
        if name == IMAGE:
            pixels = EXPECTED["size_px"][0] * EXPECTED["size_px"][1]
            lists, count = list(zip(*(frame["rgb"] for frame in expected for _ in range(pixels)))), len(rows)
            tolerance = 2 / 255  # What is lost by compressing.
        else:
            (lists, count), tolerance = values_of(name, rows), 1e-5
        for number, statistic in enumerate(STATISTICS):
            right = [statistics(values)[number] for values in lists]
            if name == IMAGE:
                right = [[[channel]] for channel in right]
            same(f"{what}: {name}/{statistic}", told(name, statistic), right, tolerance)
        same(f"{what}: {name}/count", told(name, "count"), [count])


def main():
    info = layout()
    tasks = pq.read_table(ROOT / "meta/tasks.parquet")
    same("tasks", tasks.to_pylist(), [{"task_index": i, "task": t} for i, t in enumerate(EXPECTED["tasks"])])
    same("index", json.loads(tasks.schema.metadata[b"pandas"])["index_columns"], ["task"])

    data = pq.ParquetFile(ROOT / "data/chunk-000/file-000.parquet")
    same("row groups", data.num_row_groups, len(EPISODES))
    table = data.read()
    schema(table, info)
    rows = table.to_pylist()
    frames(rows)

    stats = json.loads((ROOT / "meta/stats.json").read_text())
    every = [frame for episode in EPISODES for frame in episode["frames"]]
    check_statistics("set", lambda name, statistic: stats[name][statistic], rows, every)
    episodes = pq.read_table(ROOT / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    same("episodes", len(episodes), len(EPISODES))
    first = 0
    for number, (told, expected) in enumerate(zip(episodes, EPISODES)):
        length = len(expected["frames"])
        for key, value in {
            "episode_index": number, "tasks": [EXPECTED["tasks"][number]], "length": length,
            "dataset_from_index": first, "dataset_to_index": first + length,
            "data/chunk_index": 0, "data/file_index": 0,
            "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0,
        }.items():
            same(key, told[key], value)
        own = rows[first:first + length]
        check_statistics(f"episode {number}", lambda n, s: told[f"stats/{n}/{s}"], own, expected["frames"])
        first += length
    print(f"{len(episodes)} episodes, {len(rows)} frames, {len(stats)} features agree (pyarrow {pa.__version__})")


main()
