"""A scene of large deformation by GetFEM: reads what large.py writes of it on stdin, prints the answer as JSON.

The law and the contact are energies, of which GetFEM derives residual and tangent: the contact is an augmented Lagrangian
with multipliers on the side, of the gaps where the body is. The load is put on at once, and where Newton's method fails in
parts that are halved, from the last that has come out."""
import json
import sys
import time

import getfem
import numpy
from getfem_steps import put_on

LAWS = {"neo_hooke_isochoric": "mu/2*((Norm_sqr(F)+1)*pow(Det(F),-2/3)-3)+(la/2+mu/3)*sqr(Det(F)-1)",
        "st_venant_kirchhoff": "la/8*sqr(Norm_sqr(F)-2)+mu/4*Norm_sqr(F'*F-Id(2))"}
ORDER = [0, 4, 1, 7, 5, 3, 6, 2]  # nodes of a quad8 as GetFEM has them
MOST = 50


def mesh_of(scene):
    nodes = numpy.array(scene["nodes"])
    mesh = getfem.Mesh("empty", 2)
    for cell in scene["cells"]:
        mesh.add_convex(getfem.GeoTrans("GT_Q2_INCOMPLETE(2)"), nodes[[cell[k] for k in ORDER]].T)
    return mesh


def region_of(mesh, number, places):
    """The sides whose nodes are all among those given."""
    mesh.set_region(number, mesh.faces_from_pid(mesh.pid_from_coords(numpy.array(places).T, 1e-9)))
    return number


def vector(x):
    return f"[{','.join(map(repr, x))}]"


def gap_of(obstacle):
    """Gap and normal where the body is, as expressions; an obstacle that overlaps the body at rest is set back."""
    if "radius" in obstacle:
        way = f"(X+u-{vector(obstacle['center'])})"
        return f"(Norm{way}-{obstacle['radius']!r}+(1-t)*{obstacle['overlap']!r})", f"Normalized{way}"
    return f"((X+u-{vector(obstacle['point'])}).{vector(obstacle['normal'])})", vector(obstacle["normal"])


def model_of(scene):
    mesh = mesh_of(scene)
    inside = getfem.MeshIm(mesh, getfem.Integ("IM_GAUSS_PARALLELEPIPED(2,4)"))
    field, scalar, linear = getfem.MeshFem(mesh, 2), getfem.MeshFem(mesh, 1), getfem.MeshFem(mesh, 1)
    for one, fem in ((field, "FEM_Q2_INCOMPLETE(2)"), (scalar, "FEM_Q2_INCOMPLETE(2)"), (linear, "FEM_QK(2,1)")):
        one.set_fem(getfem.Fem(fem))
    model = getfem.Model("real")
    model.add_fem_variable("u", field)
    young, poisson = scene["young"], scene["poisson"]
    for name, value in (("mu", young / (2 + 2 * poisson)), ("la", young * poisson / ((1 + poisson) * (1 - 2 * poisson))), ("s", young), ("t", 1.0)):
        model.add_initialized_data(name, [value])
    model.add_nonlinear_term(inside, LAWS[scene["law"]].replace("F", "(Id(2)+Grad_u)"))
    number = 1
    for support in scene["supports"]:
        region = region_of(mesh, number, support["places"])
        for c, value in support["u"]:
            model.add_filtered_fem_variable(f"m{number}_{c}", scalar, region)
            model.add_linear_term(inside, f"(u({c + 1})-t*({value!r}))*Test_m{number}_{c}+m{number}_{c}*Test_u({c + 1})", region)
        number += 1
    if scene.get("traction"):
        region = region_of(mesh, number, scene["traction"]["places"])
        model.add_source_term(inside, f"t*{vector(scene['traction']['on'])}.Test_u", region)
    if scene.get("obstacle"):
        region = region_of(mesh, number, scene["obstacle"]["places"])
        model.add_filtered_fem_variable("p", linear, region)
        model.add_nonlinear_term(inside, f"(sqr(neg_part(p+s*{gap_of(scene['obstacle'])[0]}))-sqr(p))/(2*s)", region)
    return model, field, inside, number


def solve(scene):
    model, field, inside, region = model_of(scene)
    reached, steps = put_on(model, "t", ["u"], MOST, scene["search"])
    u, places = model.variable("u").reshape(-1, 2), field.basic_dof_nodes()[:, ::2].T
    probe = u[numpy.argmin(numpy.linalg.norm(places - numpy.array(scene["probe"]), axis=1))]
    force = [0.0, 0.0]
    if scene.get("obstacle"):
        normal = gap_of(scene["obstacle"])[1]
        force = [-float(getfem.asm_generic(inside, 0, f"p*({normal}({c}))", region, model)) for c in (1, 2)]
    return {"load": reached, "steps": steps, "force": force, "probe": probe.tolist()}


def main():
    scene = json.load(sys.stdin)
    getfem.util_trace_level(0)
    begun = time.process_time()
    answer = solve(scene)
    print(json.dumps({**answer, "seconds": time.process_time() - begun}))


if __name__ == "__main__":
    main()
