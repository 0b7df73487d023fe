"""Client of the contact solver service, with numpy arrays in and out.

    import uzawa
    service = uzawa.Uzawa()                     # $UZAWA_SERVER and $UZAWA_TOKEN, or http://127.0.0.1:8080
    job = service.solve(request, progress=True)
    job.summary["outcome"], job.whole_error, job["pressure"], job.history()["error_bound"]

A request is what the service takes (its scene guide), as dictionaries and lists; numpy arrays may stand for any list of
numbers in it, and matrices() makes the problem of K, N, h and p as numpy or scipy has them.
"""
from .arrays import matrices, matrix_market
from .job import Job
from .service import Refused, Uzawa

__all__ = ["Job", "Refused", "Uzawa", "matrices", "matrix_market"]
__version__ = "0.1.0"
