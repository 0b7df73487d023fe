"""Two solids in contact under large deformation by GetFEM: reads what large_solids.py writes of them on stdin, prints the
answer as JSON.

The upper body is pressed down, then moved aside; parts of either that have no answer are halved, from the last that has one.
The law is an energy, of which GetFEM derives residual and tangent."""
import json
import sys
import time

import getfem
import numpy
from getfem_steps import put_on

LAW = "mu/2*(Norm_sqr(F)-3)-mu*log(Det(F))+la/2*sqr(log(Det(F)))"
BELOW, ABOVE = 1, 2
HOW = {"unknowns": ["u0", "u1"], "most": 30, "search": "simplest", "part": 0.5}


def mesh_of(points, cells):
    """With the regions BELOW, ABOVE: sides across the second axis."""
    mesh = getfem.Mesh("empty", 3)
    for p in points:
        mesh.add_convex(getfem.GeoTrans("GT_QK(3,2)"), numpy.array(p).T)
    layer = [k // cells[0] % cells[1] for k in range(len(points))]
    for region, at, rows in ((BELOW, 0, (0, 1, 2)), (ABOVE, cells[1] - 1, (6, 7, 8))):
        on = numpy.array([p[9 * k + r] for p, row in zip(points, layer) if row == at for k in range(3) for r in rows])
        mesh.set_region(region, mesh.faces_from_pid(mesh.pid_from_coords(on.T, 1e-9)))
    return mesh


def model_of(asked):
    """(the model, how the upper body is integrated, and what has to live as long)"""
    model = getfem.Model("real")
    young, poisson, inside = asked["young"], asked["poisson"], []
    alive = []
    values = {"mu": young / (2 + 2 * poisson), "la": young * poisson / ((1 + poisson) * (1 - 2 * poisson)), "r": young, "t": 0.0, "s": 0.0}
    for name, value in values.items():
        model.add_initialized_data(name, [value])
    x, y, z = (repr(float(w)) for w in asked["way"])
    for k, (points, cells) in enumerate(zip(asked["parts"], asked["cells"])):
        mesh = mesh_of(points, cells)
        inside.append(getfem.MeshIm(mesh, getfem.Integ("IM_GAUSS_PARALLELEPIPED(3,4)")))
        field, linear = getfem.MeshFem(mesh, 3), getfem.MeshFem(mesh, 3)
        field.set_fem(getfem.Fem("FEM_QK(3,2)"))
        linear.set_classical_fem(1)
        alive += [mesh, field, linear]
        model.add_fem_variable(f"u{k}", field)
        model.add_nonlinear_term(inside[k], LAW.replace("F", f"(Id(3)+Grad_u{k})"))
        model.add_filtered_fem_variable(f"m{k}", field, ABOVE if k else BELOW)
        way = f"[s*({x});t*({y});s*({z})]" if k else "[0;0;0]"
        model.add_nonlinear_term(inside[k], f"(u{k}-{way}).Test_m{k}+m{k}.Test_u{k}", ABOVE if k else BELOW)
        if k:
            model.add_filtered_fem_variable("p", linear, BELOW)
    contact = model.add_integral_large_sliding_contact_brick_raytracing("r", 0.3)
    model.add_slave_contact_boundary_to_large_sliding_contact_brick(contact, inside[1], BELOW, "u1", "p")
    model.add_master_contact_boundary_to_large_sliding_contact_brick(contact, inside[0], ABOVE, "u0")
    return model, inside[1], alive + inside


def main():
    asked = json.load(sys.stdin)
    getfem.util_trace_level(0)
    begun = time.process_time()
    model, inside, _alive = model_of(asked)
    down, first = put_on(model, "t", **HOW)
    aside, second = put_on(model, "s", **HOW) if down == 1 else (0, 0)
    force = [float(getfem.asm_generic(inside, 0, f"m1({c})", ABOVE, model)) for c in (1, 2, 3)]
    print(json.dumps({"load": aside, "steps": first + second, "force": force, "seconds": time.process_time() - begun}))


if __name__ == "__main__":
    main()
