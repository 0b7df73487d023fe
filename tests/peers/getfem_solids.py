"""Two bodies in contact under large deformation by GetFEM: reads what large_solids.py writes of them on stdin, prints the
answer as JSON.

What is held goes down, along the second axis, then aside; parts of either that have no answer are halved, from the last that
has one. The law is an energy, of which GetFEM derives residual and tangent."""
import json
import sys
import time

import getfem
import numpy
from getfem_steps import put_on

LAW = {2: "mu/2*(Norm_sqr(F)-2)-mu*log(Det(F))+la/2*sqr(log(Det(F)))", 3: "mu/2*(Norm_sqr(F)-3)-mu*log(Det(F))+la/2*sqr(log(Det(F)))"}
HOW = {"unknowns": ["u0", "u1"], "most": 30, "search": "simplest", "part": 0.5}


def mesh_of(points, cells, sides):
    """With the regions 1, 2, ...: these sides, as "y1"."""
    dim = len(cells)
    mesh = getfem.Mesh("empty", dim)
    for p in points:
        mesh.add_convex(getfem.GeoTrans(f"GT_QK({dim},2)"), numpy.array(p).T)
    for number, (axis, end) in enumerate(((ord(side[0]) - ord("x"), int(side[1])) for side in sides), 1):
        stride = int(numpy.prod(cells[:axis]))
        own = [r for r in range(3 ** dim) if r // 3 ** axis % 3 == 2 * end]
        on = numpy.array([p[r] for k, p in enumerate(points) if k // stride % cells[axis] == (cells[axis] - 1) * end for r in own])
        mesh.set_region(number, mesh.faces_from_pid(mesh.pid_from_coords(on.T, 1e-9)))
    return mesh


def model_of(asked):
    """(the model, how the upper body is integrated, what acts on it: (axis, expression, region), what has to live as long)"""
    model, dim = getfem.Model("real"), len(asked["cells"][0])
    young, poisson, inside = asked["young"], asked["poisson"], []
    alive, acting = [], []
    values = {"mu": young / (2 + 2 * poisson), "la": young * poisson / ((1 + poisson) * (1 - 2 * poisson)), "r": young, "t": 0.0, "s": 0.0}
    for name, value in values.items():
        model.add_initialized_data(name, [value])
    for k, (points, cells) in enumerate(zip(asked["parts"], asked["cells"])):
        held = [(side, u) for part, side, u in asked["held"] if part == k]
        mesh = mesh_of(points, cells, [asked["touch"][1 - k]] + [side for side, _ in held])
        inside.append(getfem.MeshIm(mesh, getfem.Integ(f"IM_GAUSS_PARALLELEPIPED({dim},4)")))
        field, scalar, linear = getfem.MeshFem(mesh, dim), getfem.MeshFem(mesh, 1), getfem.MeshFem(mesh, dim)
        for one in (field, scalar):
            one.set_fem(getfem.Fem(f"FEM_QK({dim},2)"))
        linear.set_classical_fem(1)
        alive += [mesh, field, scalar, linear]
        model.add_fem_variable(f"u{k}", field)
        model.add_nonlinear_term(inside[k], LAW[dim].replace("F", f"(Id({dim})+Grad_u{k})"))
        for region, (_, u) in enumerate(held, 2):
            for c, value in u:
                name = f"m{k}_{region}_{c}"
                model.add_filtered_fem_variable(name, scalar, region)
                model.add_linear_term(inside[k], f"(u{k}({c + 1})-{'t' if c == 1 else 's'}*({float(value)!r}))*Test_{name}+{name}*Test_u{k}({c + 1})", region)
                acting += [(c, name, region)] * k
        if k:
            model.add_filtered_fem_variable("p", linear, 1)
    contact = model.add_integral_large_sliding_contact_brick_raytracing("r", 0.3)
    model.add_slave_contact_boundary_to_large_sliding_contact_brick(contact, inside[1], 1, "u1", "p")
    model.add_master_contact_boundary_to_large_sliding_contact_brick(contact, inside[0], 1, "u0")
    return model, inside[1], acting, alive + inside


def main():
    asked = json.load(sys.stdin)
    getfem.util_trace_level(0)
    begun = time.process_time()
    model, inside, acting, _alive = model_of(asked)
    down, first = put_on(model, "t", **HOW)
    aside, second = put_on(model, "s", **HOW) if down == 1 else (0, 0)
    force = [sum(float(getfem.asm_generic(inside, 0, name, region, model)) for c, name, region in acting if c == axis) for axis in range(len(asked["cells"][0]))]
    print(json.dumps({"load": aside, "steps": first + second, "force": force, "seconds": time.process_time() - begun}))


if __name__ == "__main__":
    main()
