"""An independent reader (meshio) opens what `topple export --vtk` wrote; the corners are those of the record (h5py)."""

import sys
import xml.etree.ElementTree
from pathlib import Path

import h5py
import meshio
import numpy


def rotate(q, v):
    """v turned by the unit quaternion q = (w, x, y, z)."""
    w, u = q[0], q[1:]
    return v + 2 * numpy.cross(u, numpy.cross(u, v) + w * v)


record, folder = h5py.File(sys.argv[1]), Path(sys.argv[2])
time = record["frames/time"][:]
entries = [e.attrib for e in xml.etree.ElementTree.parse(folder / "record.pvd").iter("DataSet")]
assert [float(e["timestep"]) for e in entries if e["part"] == "0"] == list(time), "times differ"

owner = record["shapes/body"][:]
ends = {name: record["crushed_ends/" + name][:] for name in ("body", "shape", "axis", "side")}
shape_of_end = numpy.searchsorted(owner, ends["body"]) + ends["shape"]


def leave(frame):
    """Centres and half edges of all boxes in their bodies, as crushing leaves them."""
    centre, half = record["shapes/centre"][:], record["shapes/half"][:]
    for k, axis, side, by in zip(shape_of_end, ends["axis"], ends["side"], record["frames/crushed_length"][frame]):
        half[k, axis] -= by / 2
        centre[k] -= side * by / 2 * rotate(record["shapes/orientation"][k], numpy.eye(3)[axis])
    return centre, half


checked = 0
for frame in (0, len(time) // 2, len(time) - 1):
    mesh = meshio.read(folder / entries[3 * frame]["file"])
    assert [block.type for block in mesh.cells] == ["hexahedron"], mesh.cells
    corners = mesh.points[mesh.cells[0].data]  # shapes x 8 x 3
    assert len(corners) == len(owner)
    centres, halves = leave(frame)
    for k, body in enumerate(owner):
        q, p = record["frames/orientation"][frame, body], record["frames/position"][frame, body]
        q = q / numpy.linalg.norm(q)
        centre = p + rotate(q, centres[k])
        # corners 0 and 6 are opposite, 0-1, 0-3, 0-4 the edges; float32 of some ten metres
        assert numpy.allclose(corners[k].mean(axis=0), centre, atol=2e-5), (frame, k)
        edges = [numpy.linalg.norm(corners[k][i] - corners[k][0]) for i in (1, 3, 4)]
        assert numpy.allclose(edges, 2 * halves[k], atol=2e-5), (frame, k)
        volume = numpy.dot(numpy.cross(corners[k][1] - corners[k][0], corners[k][3] - corners[k][0]),
                           corners[k][4] - corners[k][0])
        assert volume > 0, "a cell is inside out"
        checked += 8
    assert list(mesh.cell_data["body"][0]) == list(owner)
    zones = meshio.read(folder / entries[3 * frame + 1]["file"])
    assert list(zones.cell_data["state"][0]) == list(record["frames/zone_state"][frame])
site = meshio.read(folder / entries[2]["file"])
assert len(site.points) == len(record["building_outline"]) + len(record["neighbour_corners/position"])
print(f"{checked} corners of {len(time)} frames agree")
