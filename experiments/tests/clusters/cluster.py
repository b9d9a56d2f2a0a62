# A HyperQueue server, or a worker of it, as a process of its own that can be killed.
#   cluster.py server FOLDER
#   cluster.py worker FOLDER SERVERS-FOLDER
# The package starts workers only beside the server of the same process: a worker's own
# server is left idle, and the worker is told the other's address.
import shutil
import sys
import time

from hyperqueue.cluster import LocalCluster, WorkerConfig

what, folder, *servers = sys.argv[1:]
cluster = LocalCluster(folder)
if what == "worker":
    shutil.copy(f"{servers[0]}/hq-current/access.json", f"{folder}/hq-current/access.json")
    cluster.start_worker(WorkerConfig(cores=1))
print("ready", flush=True)
while True:
    time.sleep(60)
