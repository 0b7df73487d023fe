"""Solves the request in a file and says where it touches, how hard, and how sure that is.

usage: submit_and_wait.py REQUEST.json          exit status 0: certified as asked, and every assertion passes
"""
import json
import sys

from uzawa import Uzawa


def main(path):
    service = Uzawa()
    with open(path, encoding="utf-8") as file:
        request = json.load(file)
    job = service.wait(service.submit(request, wait_s=10)["id"])
    summary = job["summary"]
    contact, certificate = summary["contact"], summary["certificate"]
    print(f"{summary['outcome']}: {contact['active']} of {contact['candidates']} points touch")
    if contact.get("max_pressure") is not None:
        print(f"largest pressure {contact['max_pressure']:.6g} at node {contact['max_pressure_at']['node']}")
    if certificate["relative_error"] is not None:
        print(f"the exact displacements are within {certificate['relative_error']:.2g} of these (relative, energy norm)")
    for line in summary.get("assertions", []):
        print(f"{line['result']}: {line.get('name', line['quantity'])} = {line['value']} {line.get('reason', '')}")
    return 0 if summary["outcome"] == "converged" and summary.get("assertions_passed", True) else 1


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1]))
