"""Reads a record of topple: what happened, how far it fell, and the path of one body.

    python3 read_record.py out/record.h5
"""

import sys

import h5py
import numpy


def texts(dataset):
    return list(dataset.asstr())


def main(path):
    with h5py.File(path) as record:
        print(record["provenance/title"].asstr()[()])
        time = record["frames/time"][:]
        if len(time) == 0:
            sys.exit(f"no frames: {record['ending/text'].asstr()[()]}")
        print(f"{len(time)} frames from {time[0]:.2f} s to {time[-1]:.2f} s: {record['ending/text'].asstr()[()]}")

        # the findings, as the program prints them
        for title, text in zip(texts(record["findings/title"]), texts(record["findings/text"])):
            print(f"- {title}: {text}")

        # a quantity over time: rows of series/value, one per id
        ids = texts(record["series/id"])
        kinetic = record["series/value"][ids.index("energy_kinetic")]
        most = int(numpy.argmax(kinetic))
        print(f"largest kinetic energy: {kinetic[most] / 1e6:.2f} MJ at {time[most]:.2f} s")

        # the body that fell farthest: frames/position is frames x bodies x (x y z), in metres, z up
        fall = record["frames/position"][0, :, 2] - record["frames/position"][-1, :, 2]
        body = int(numpy.argmax(fall))
        print(f"farthest fall: {record['bodies/name'].asstr()[body]}, {fall[body]:.2f} m")

        # a point of that body, 1 m along its own x axis, in the last frame
        w, x, y, z = record["frames/orientation"][-1, body]
        axis = numpy.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
        print("a point of it:", numpy.round(record["frames/position"][-1, body] + axis, 2))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
