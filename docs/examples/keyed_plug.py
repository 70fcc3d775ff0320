"""Draws a keyed plug and its socket, and writes each as STL and as STEP (millimetres).

    python3 keyed_plug.py FOLDER

Parts are prisms stacked along z: an outline (counterclockwise) with holes (clockwise) between two heights.
"""

import pathlib
import sys

CLEARANCE = 0.2  # a side


def outline(grow):
    """A rectangle of 16 x 8 mm with a key of 3 x 1.5 mm on one long side, all sides moved out by `grow`."""
    g = grow
    return [(-8 - g, -4 - g), (8 + g, -4 - g), (8 + g, 4 + g), (1.5 + g, 4 + g), (1.5 + g, 5.5 + g),
            (-1.5 - g, 5.5 + g), (-1.5 - g, 4 + g), (-8 - g, 4 + g)]


def plug():
    loop = outline(0)
    return wall(loop, 0, 50) + [([loop[::-1]], 0), ([loop], 50)]


def socket():
    block = [(-16, -13), (16, -13), (16, 13), (-16, 13)]
    hole = outline(CLEARANCE)[::-1]
    return (wall(block, -18, 0) + wall(hole, -12, 0)
            + [([block[::-1]], -18), ([block, hole], 0), ([hole[::-1]], -12)])


def wall(loop, low, high):
    """Upright faces over the sides of a loop, as lists of corners in space."""
    faces = []
    for (ax, ay), (bx, by) in zip(loop, loop[1:] + loop[:1]):
        faces.append([[(ax, ay, low), (bx, by, low), (bx, by, high), (ax, ay, high)]])
    return faces


def in_space(face):
    """Loops of corners in space, of an upright face or of a flat one given as (loops, height)."""
    if isinstance(face, tuple):
        loops, z = face
        return [[(x, y, z) for x, y in loop] for loop in loops]
    return face


def cross(o, a, b):
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])


def bridged(loops):
    """One loop of a flat face with a hole: joined at the nearest pair of corners that see each other."""
    outer, hole = loops
    i, j = min(((i, j) for i in range(len(outer)) for j in range(len(hole))),
               key=lambda ij: sum((outer[ij[0]][k] - hole[ij[1]][k]) ** 2 for k in range(2)))
    return outer[:i + 1] + hole[j:] + hole[:j + 1] + outer[i:]


def triangles(face):
    loops = in_space(face)
    loop = bridged(loops) if len(loops) == 2 else list(loops[0])
    flat = len({p[2] for p in loop}) == 1
    if not flat:
        return [(loop[0], loop[1], loop[2]), (loop[0], loop[2], loop[3])]
    turned = sum(cross((0, 0), a, b) for a, b in zip(loop, loop[1:] + loop[:1])) < 0
    found, left = [], loop[::-1] if turned else loop
    while len(left) > 3:  # ears
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            if cross(a, b, c) <= 0:
                continue
            others = [p for p in left if p not in (a, b, c)]
            if any(cross(a, b, p) >= 0 and cross(b, c, p) >= 0 and cross(c, a, p) >= 0 for p in others):
                continue
            found.append((a, b, c))
            left = left[:k] + left[k + 1:]
            break
        else:
            raise ValueError("no ear")
    found.append(tuple(left))
    return [t[::-1] for t in found] if turned else found


def write_stl(faces, path):
    with open(path, "w") as out:
        out.write("solid part\n")
        for face in faces:
            for t in triangles(face):
                out.write("facet normal 0 0 0\n outer loop\n")
                out.writelines("  vertex %.6f %.6f %.6f\n" % p for p in t)
                out.write(" endloop\nendfacet\n")
        out.write("endsolid part\n")


def write_step(faces, path, name):
    """A closed shell of plane faces, as AP214 has it."""
    lines, known = [], {}

    def add(text, key=None):
        if key is not None and key in known:
            return known[key]
        lines.append("#%d=%s;" % (len(lines) + 1, text))
        if key is not None:
            known[key] = len(lines)
        return len(lines)

    def triple(kind, v):
        return add("%s('',(%.6f,%.6f,%.6f))" % ((kind,) + tuple(v)))

    def vertex(p):
        return known.get(("v", p)) or add("VERTEX_POINT('',#%d)" % triple("CARTESIAN_POINT", p), ("v", p))

    def edge(a, b):
        if ("e", b, a) in known:
            return add("ORIENTED_EDGE('',*,*,#%d,.F.)" % known[("e", b, a)])
        d = [q - p for p, q in zip(a, b)]
        length = sum(x * x for x in d) ** 0.5
        vector = add("VECTOR('',#%d,%.6f)" % (triple("DIRECTION", [x / length for x in d]), length))
        line = add("LINE('',#%d,#%d)" % (triple("CARTESIAN_POINT", a), vector))
        curve = add("EDGE_CURVE('',#%d,#%d,#%d,.T.)" % (vertex(a), vertex(b), line), ("e", a, b))
        return add("ORIENTED_EDGE('',*,*,#%d,.T.)" % curve)

    shell = []
    for face in faces:
        loops = in_space(face)
        a, b, c = triangles(face)[0]
        u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]
        n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        size, along = sum(x * x for x in n) ** 0.5, sum(x * x for x in u) ** 0.5
        frame = add("AXIS2_PLACEMENT_3D('',#%d,#%d,#%d)" % (
            triple("CARTESIAN_POINT", a), triple("DIRECTION", [x / size for x in n]),
            triple("DIRECTION", [x / along for x in u])))
        bounds = []
        for k, loop in enumerate(loops):
            edges = ",".join("#%d" % edge(p, q) for p, q in zip(loop, loop[1:] + loop[:1]))
            kind = "FACE_OUTER_BOUND" if k == 0 else "FACE_BOUND"
            bounds.append("#%d" % add("%s('',#%d,.T.)" % (kind, add("EDGE_LOOP('',(%s))" % edges))))
        plane = add("PLANE('',#%d)" % frame)
        shell.append("#%d" % add("ADVANCED_FACE('',(%s),#%d,.T.)" % (",".join(bounds), plane)))
    solid = add("MANIFOLD_SOLID_BREP('%s',#%d)" % (name, add("CLOSED_SHELL('',(%s))" % ",".join(shell))))
    length = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid_angle = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    uncertainty = add("UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-6),#%d,'accuracy','')" % length)
    context = add("(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#%d))"
                  "GLOBAL_UNIT_ASSIGNED_CONTEXT((#%d,#%d,#%d))REPRESENTATION_CONTEXT('',''))"
                  % (uncertainty, length, angle, solid_angle))
    shape = add("ADVANCED_BREP_SHAPE_REPRESENTATION('',(#%d),#%d)" % (solid, context))
    application = add("APPLICATION_CONTEXT('automotive design')")
    product = add("PRODUCT('%s','%s','',(#%d))" % (name, name, add("PRODUCT_CONTEXT('',#%d,'mechanical')" % application)))
    formation = add("PRODUCT_DEFINITION_FORMATION('','',#%d)" % product)
    definition = add("PRODUCT_DEFINITION('','',#%d,#%d)" % (
        formation, add("PRODUCT_DEFINITION_CONTEXT('part definition',#%d,'design')" % application)))
    add("SHAPE_DEFINITION_REPRESENTATION(#%d,#%d)" % (add("PRODUCT_DEFINITION_SHAPE('','',#%d)" % definition), shape))
    pathlib.Path(path).write_text(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('%s','',(''),(''),'','','');\n"
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n%s\nENDSEC;\nEND-ISO-10303-21;\n"
        % (name, "\n".join(lines)))


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for part_name, part in (("plug", plug()), ("socket", socket())):
        write_stl(part, folder / (part_name + ".stl"))
        write_step(part, folder / (part_name + ".step"), part_name)
