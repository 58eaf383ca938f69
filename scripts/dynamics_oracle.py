"""Prints mass matrix and bias torques of sim_host/models/k3s.toml by Pinocchio, for the test in sim_host/src/plant.

Joint coordinates, without rotors and friction. Needed once per change of the model, never to build or run:
    python3 -m venv target/oracle && target/oracle/bin/pip install pin && target/oracle/bin/python scripts/dynamics_oracle.py
"""

import pathlib
import tomllib

import numpy as np
import pinocchio as pin

MODEL = pathlib.Path(__file__).parents[1] / "sim_host/models/k3s.toml"
STATES = [
    ([0.3, -1.7, 0.2, 0.4, -1.3, 0.9], [0.5, -0.4, 0.3, 0.6, -0.7, 1.1]),
    ([-0.8, -1.1, -0.6, -1.2, -2.0, 3.1], [-1.5, 1.2, 0.9, -2.0, 1.7, -3.0]),
]


def build(axes):
    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -9.80665])
    parent = 0
    for axis in axes:
        twist = np.radians(axis["twist_deg"])
        s, c = np.sin(twist), np.cos(twist)
        # Craig's step without its turn about z: d lies along the turned axis and commutes with the turn.
        placement = pin.SE3(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.array([axis["a"], -s * axis["d"], c * axis["d"]]))
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, axis["name"])
        xx, yy, zz, xy, xz, yz = axis["inertia"]
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        body = pin.Inertia(axis["mass"], np.array(axis["centre"]), tensor)
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
    return model


def rust(values):
    return "[" + ", ".join(f"{v:.12}" for v in values) + "]"


def main():
    model = build(tomllib.loads(MODEL.read_text())["axes"])
    for q, dq in STATES:
        data = model.createData()
        mass = pin.crba(model, data, np.array(q))
        mass = np.triu(mass) + np.triu(mass, 1).T
        print("q", q, "dq", dq)
        print("mass matrix")
        for row in mass:
            print("   ", rust(row) + ",")
        print("bias", rust(pin.nonLinearEffects(model, data, np.array(q), np.array(dq))))


if __name__ == "__main__":
    main()
