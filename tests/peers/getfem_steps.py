"""How far GetFEM comes with a load under large deformation: where Newton's method fails the part is halved, from the last
that has an answer."""
import numpy

LEAST_PART, ERROR = 1 / 64, 1e-9


def put_on(model, name, unknowns, most, search, part=1.0):
    """The variable `name` from 0 to 1, parts at first of `part`. (the part that has an answer, steps)"""
    reached, steps_of_all = 0.0, 0
    kept = model.from_variables()
    while reached < 1 and part >= LEAST_PART:
        model.set_variable(name, [min(1.0, reached + part)])
        try:
            steps, good = model.solve("max_res", ERROR, "max_iter", most, "lsolver", "mumps", "lsearch", search)
            good = bool(good) and all(numpy.all(numpy.isfinite(model.variable(u))) for u in unknowns)
        except RuntimeError:
            steps, good = most, False
        steps_of_all += steps
        if good:
            reached = min(1.0, reached + part)
            kept = model.from_variables()
        else:
            part /= 2
            model.to_variables(kept)
    return reached, steps_of_all
