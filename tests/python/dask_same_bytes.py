"""Runs examples/dask on a LocalCluster and compares with one process: dask_same_bytes.py EXAMPLE FOLDER SCENARIO STUDY DATABASE

Kills a worker while the sweep runs. CRUMPLE names the program.
"""

import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

from dask.distributed import Client, LocalCluster

example, folder, scenario, study, database = sys.argv[1:]
sys.path.insert(0, example)
import crumple_dask


def kill_one(client, parts):
    """Kills a worker as soon as a shard is being written."""
    while not any(parts.glob("*.part")):
        time.sleep(0.01)
    pids = client.run(os.getpid)
    os.kill(next(iter(pids.values())), signal.SIGKILL)
    killed.append(len(pids))


def leave(example):
    """Makes a worker one that was started elsewhere: in another folder, without the example."""
    os.chdir("/")
    sys.path[:] = [path for path in sys.path if path != example]


def main():
    os.chdir(folder)
    os.environ["SOURCE_DATE_EPOCH"] = "1700000000"
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        client.run(leave, example)
        thread = threading.Thread(target=kill_one, args=(client, pathlib.Path("sweep.csv.parts")))
        thread.start()
        report = crumple_dask.sweep(client, scenario, "sweep.csv", shards=7)
        thread.join()
        # Again, and divided in another way.
        for shards in (3, 3, 2):
            crumple_dask.build(client, study, "built.h5", shards)
        crumple_dask.validate(client, database, "validation.json")
        crumple_dask.sweep(client, scenario, "again.csv", shards=1)
    one = crumple_dask.PROGRAM
    subprocess.run([one, "sweep", scenario, "-o", "one.csv", "--quiet"], check=True)
    subprocess.run([one, "build", study, "-o", "one.h5", "--quiet"], check=True)
    with open("one.json", "w") as out:
        subprocess.run([one, "validate", database, "--json"], check=True, stdout=out, stderr=subprocess.DEVNULL)
    for ours, theirs in [("sweep.csv", "one.csv"), ("again.csv", "one.csv"), ("built.h5", "one.h5"), ("validation.json", "one.json")]:
        same = pathlib.Path(ours).read_bytes() == pathlib.Path(theirs).read_bytes()
        print(f"{ours}: {'the same bytes' if same else 'DIFFERS'}")
    print(f"a worker of {killed[0]} was killed, the sweep has {report['rows']} rows")


killed = []
if __name__ == "__main__":
    main()
