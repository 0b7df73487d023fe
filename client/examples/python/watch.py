"""Watches a job while it runs, by Server-Sent Events, and stops it once its certified error is small enough.

usage: watch.py REQUEST.json [ENOUGH]           ENOUGH: a bound on the energy-norm error, in the request's units
"""
import json
import sys

from uzawa import Uzawa


def main(path, enough):
    service = Uzawa()
    with open(path, encoding="utf-8") as file:
        job = service.submit(json.load(file))
    stopped = False
    for event, data in service.events(job["id"]):
        if event == "status":
            job = data
            print(data["status"])
        elif data.get("error_bound") is not None:
            print(f"{data['progress']:3d} %  iteration {data['iteration']:.0f}  error at most {data['error_bound']:.3g}")
            if data["error_bound"] <= enough and not stopped:
                stopped = True
                service.open("DELETE", f"/v1/jobs/{job['id']}").close()
    if job["summary"]:
        bound = job["summary"]["certificate"]["absolute_error"]  # None: nothing could be certified
        print(f"{job['summary']['outcome']}: error {'unknown' if bound is None else f'at most {bound:.3g}'}")
    return 0 if job["summary"] else 1


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 0))
