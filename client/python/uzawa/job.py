"""A job: what the service said of it last, and its answer as numpy arrays."""
from __future__ import annotations

import html
import urllib.parse
from typing import TYPE_CHECKING, Any, Iterator, Optional

import numpy as np

if TYPE_CHECKING:
    from .service import Uzawa

ENDED = ("successful", "failed", "dismissed")


class Job(dict):
    """The service's document of a job (id, status, summary, ...), and what else there is to ask about it.

    job["pressure"] and the other fields of a result are numpy arrays, fetched when first asked for.
    """

    def __init__(self, service: "Uzawa", document: dict) -> None:
        super().__init__(document)
        self.service = service
        self._fields: dict = {}

    def __missing__(self, name: str) -> Any:
        if name not in self._fields:
            self._fields.update(self.result(name))
        try:
            return self._fields[name]
        except KeyError:
            raise KeyError(f"{name!r}: the answer has no such field") from None

    # ---- what is known of it

    @property
    def id(self) -> str:
        return self["id"]

    @property
    def ended(self) -> bool:
        return self["status"] in ENDED

    @property
    def summary(self) -> dict:
        return self["summary"] or {}

    @property
    def outcome(self) -> str:
        """"converged" and the like; of a job without an answer its status."""
        return self.summary.get("outcome", self["status"])

    @property
    def converged(self) -> bool:
        return self.outcome == "converged"

    @property
    def passed(self) -> bool:
        """Converged, and every assertion passes."""
        return self.converged and self.summary.get("assertions_passed", True)

    @property
    def whole_error(self) -> Optional[float]:
        """Of mesh and equations together, relative, in the energy norm; of matrices that of the equations. None: unknown.
        job.summary["error"]["kind"] says whether it is guaranteed or estimated."""
        error = self.summary.get("error") or {}
        certificate = self.summary.get("certificate") or {}
        return error.get("total", certificate.get("relative_error"))

    # ---- what is asked for

    def wait(self, progress: Any = False) -> "Job":
        """Waits until it has ended; raises Refused where it failed. progress: see Uzawa.solve."""
        self.update(self.service.wait(self.id, progress))
        self._fields.clear()
        return self

    def result(self, *fields: str, case: Optional[str] = None) -> dict:
        """Fields of the answer: see Uzawa.result."""
        return self.service.result(self.id, *fields, case=case)

    def history(self, case: Optional[str] = None) -> dict:
        """The convergence history: an array for each column, a number for each iteration."""
        rows: list = []
        while True:  # in parts, until nothing is behind the last iteration
            query = {**({"case": case} if case else {}), **({"after": int(rows[-1][0])} if rows else {})}
            part = self.service.call("GET", f"/v1/jobs/{self.id}/history?{urllib.parse.urlencode(query)}")
            columns = part["columns"]
            rows += part["rows"]
            if not part["rows"]:
                break
        table = np.array(rows, dtype=float).reshape(len(rows), len(columns))
        return {name: table[:, i] for i, name in enumerate(columns)}

    def events(self) -> Iterator[tuple]:
        """Pairs of a name ("status", "progress") and its data, until it has ended."""
        return self.service.events(self.id)

    def picture(self, kind: str = "deformed", **query: Any) -> str:
        """SVG: "deformed" (colour, factor, width, view, up, case), "convergence" (x, theme, width, case) or "whole-error"."""
        with self.service.open("GET", f"/v1/jobs/{self.id}/{kind}.svg?{urllib.parse.urlencode(query)}") as reply:
            return reply.read().decode()

    def dismiss(self) -> None:
        """Stops it, or takes it out of the queue; the best answer so far stays."""
        if not self.ended:
            self.service.open("DELETE", f"/v1/jobs/{self.id}").close()

    # ---- in a notebook

    def words(self) -> str:
        """One line: the outcome, and how far the answer may be off."""
        error = self.summary.get("error") or {}
        if self.whole_error is None:
            return self.outcome
        kind = error.get("kind", "certified for these equations")
        return f"{self.outcome}, whole error {100 * self.whole_error:.2g} % ({kind})"

    def __repr__(self) -> str:
        return f"<Job {self.id}: {self.words()}>"

    def _repr_html_(self) -> str:
        contact, picture = self.summary.get("contact") or {}, ""
        rows = [("job", self.id), ("answer", self.words())]
        if contact:
            rows.append(("contact", f"{contact['active']} of {contact['candidates']} candidates touch"))
        for one in self.summary.get("quantities") or []:
            width = "" if one["low"] is None else f" ± {(one['high'] - one['low']) / 2:.2g} ({one['kind']})"
            rows.append((one["name"], f"{one['value']:.6g}{width}"))
        rows += [("warning", one["message"]) for one in self.summary.get("warnings") or []]
        if self["status"] == "failed":
            rows.append(("error", self["error"]["detail"]))
        elif self.ended and "resultants" in self.summary:
            picture = self.picture(width=600)
            picture = picture[max(picture.find("<svg"), 0):]
        cells = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)
        return f"<table>{cells}</table>{picture}"
