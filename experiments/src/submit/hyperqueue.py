# Hands shards to a HyperQueue server and waits until each has ended, well or badly.
import json
import os
import sys

from hyperqueue import Client, Job
from hyperqueue.task.task import ResourceRequest

given = json.load(sys.stdin)
job = Job(name="shards", max_fails=None)
for number, log in given["shards"]:
    # Appended to, for a shard may be tried again.
    words = ["/bin/sh", "-c", 'log=$1; shift; exec "$@" >>"$log" 2>&1', "sh", log]
    job.program(
        [*words, given["script"], str(number), given["token"]],
        stdout=None,
        stderr=None,
        resources=ResourceRequest(cpus=given["threads"]),
    )
client = Client(os.environ.get("HQ_SERVER_DIR"))
client.wait_for_jobs([client.submit(job)], raise_on_error=False)
