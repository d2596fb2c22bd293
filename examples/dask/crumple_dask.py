"""Sweeps, builds and validations of crumple as tasks of Dask.

    from dask.distributed import Client
    import crumple_dask

    client = Client("tcp://scheduler:8786")  # yours: of a cluster, or a LocalCluster
    crumple_dask.sweep(client, "scenario.toml", "results.csv", shards=64)

Every task is a run of the program on a part of the work that writes a file of its own in a folder that all workers
see. It may be tried again any number of times: what is complete is not done again. Joined, the files are the bytes
that one process would have written.
"""

import hashlib
import json
import os
import pathlib
import subprocess
import time
import tomllib

PROGRAM = os.environ.get("CRUMPLE", "crumple")
RETRIES = 5


def run(*arguments, date=None):
    """Run the program on one core and return what it prints."""
    environment = {**os.environ, "RAYON_NUM_THREADS": "1"}
    if date:
        environment["SOURCE_DATE_EPOCH"] = str(date)
    words = [PROGRAM, *map(str, arguments), "--json"]
    while True:
        done = subprocess.run(words, env=environment, capture_output=True, text=True)
        if done.returncode == 0:
            return done.stdout
        # The program of a worker that was killed may still be at this part: it will be complete then.
        if '"code": "locked"' not in done.stdout:
            raise RuntimeError(f"{' '.join(words)}\n{done.stderr or done.stdout}")
        time.sleep(1)


def _all(client, tasks):
    """Run tasks, each the arguments and a date, and return what they print."""
    # Workers that were started elsewhere do not have this module.
    client.upload_file(__file__)
    futures = [client.submit(run, *task, date=date, retries=RETRIES, pure=False) for task, date in tasks]
    return client.gather(futures)


def _absolute(*paths):
    """The working folder of a worker may be another one."""
    return [pathlib.Path(path).resolve() for path in paths]


def _name(entry):
    """The name of a run as the program has it."""
    name = entry.get("name", entry["path"])
    for up in ("./", "../"):
        while name.startswith(up):
            name = name.removeprefix(up)
    return name.strip("/").replace("/", "_")


def _folder(output):
    folder = pathlib.Path(f"{output}.parts")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def sweep(client, scenario, output, shards):
    """Run a sweep in so many shards and join them; a file that exists is complete and kept."""
    scenario, output = _absolute(scenario, output)
    parts = [_folder(output) / f"part{k}of{shards}.csv" for k in range(1, shards + 1)]
    tasks = [("sweep", scenario, "--shard", f"{k}/{shards}", "-o", part) for k, part in enumerate(parts, 1)]
    _all(client, [(task, None) for task in tasks])
    joined = _folder(output) / "joined.csv"
    joined.unlink(missing_ok=True)
    report = json.loads(run("sweep", "merge", *parts, "-o", joined))
    joined.replace(output)
    return report


def build(client, study, output, shards):
    """Build a study in so many parts and join them."""
    study, output = _absolute(study, output)
    # One date for all, as one process has it.
    date = int(os.environ.get("SOURCE_DATE_EPOCH", time.time()))
    text = pathlib.Path(study).read_bytes()
    entries = tomllib.loads(text.decode())["run"]
    names = [_name(entry) for entry in entries]
    # With "=", since a name may begin with a hyphen.
    chosen = [[f"--run={name}" for name in names[k::shards]] for k in range(min(shards, len(names)))]
    # Parts of another division, or of another study, hold other cases.
    name = f"of{len(chosen)}-{hashlib.sha256(text).hexdigest()[:12]}.h5"
    parts = [_folder(output) / f"part{k}{name}" for k in range(1, len(chosen) + 1)]
    tasks = [(("build", study, "-o", part, *runs), date) for part, runs in zip(parts, chosen)]
    _all(client, tasks)
    joined = _folder(output) / "joined.h5"
    joined.unlink(missing_ok=True)
    if len(parts) == 1:
        run("db", "copy", parts[0], "--to", joined, date=date)
    else:
        run("db", "merge", *parts, "-o", joined, date=date)
    joined.replace(output)


def validate(client, database, output):
    """Validate every group of a database and write the document that `crumple validate --json` prints."""
    database, output = _absolute(database, output)
    groups = list(json.loads(run("db", "ls", database))["groups"])
    documents = _all(client, [(("validate", database, "--group", group), None) for group in groups])
    # Each document holds one group: its text is between the brackets of the list.
    parts = [(text.index("[") + 1, text.rindex("\n  ]")) for text in documents]
    inside = [text[start:end] for text, (start, end) in zip(documents, parts)]
    (start, end), text = parts[0], documents[0]
    pathlib.Path(output).write_text(text[:start] + ",".join(inside) + text[end:])
