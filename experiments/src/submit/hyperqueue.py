# Hands shards to a HyperQueue server and waits until each has ended, well or badly.
import json
import os
import sys
import threading

# What goes wrong is told in the last line, by words and not by where it happened.
os.environ |= {"TQDM_DISABLE": "1", "RUST_BACKTRACE": "0"}


def fail(kind, error, _):
    print(f"{kind.__name__}: {str(error).strip() or kind.__name__}".splitlines()[0], file=sys.stderr)


sys.excepthook = fail


def end_with_parent():
    sys.stdin.read()
    os._exit(1)


from hyperqueue import Client, Job
from hyperqueue.task.task import ResourceRequest

given = json.loads(sys.stdin.readline())
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
threading.Thread(target=end_with_parent, daemon=True).start()
client = Client(os.environ.get("HQ_SERVER_DIR"))
client.wait_for_jobs([client.submit(job)], raise_on_error=False)
