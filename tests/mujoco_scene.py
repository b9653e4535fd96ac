"""The lab's scene built in MuJoCo, as an independent check: the arm moves as a whole, contact and springs are MuJoCo's.

Only figures are taken from the lab. Servo and reaction are written down again here.
"""

from __future__ import annotations

import mujoco
import numpy as np

STEP = 5e-5  # [s]
PLATE = 0.03  # mass of each of the two plates [kg]: far below what it meets
RADIUS = 0.02  # of the sphere at the contact point [m]
THICK = 0.01  # half the thickness of the plates [m]


def quaternion(rotation):
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(rotation).ravel())
    return " ".join(f"{value:.12g}" for value in found)


def text(values):
    return " ".join(f"{value:.12g}" for value in np.ravel(values))


def scene(virtual, sphere, point, body_mass):
    """MJCF of the arm, a sphere in its last link's frame, and below it two plates, pad and device, maybe on a mass."""
    opened, inner = "", ""
    for number, (joint, armature) in enumerate(
        zip(virtual.robot.joints, virtual.robot.drive_inertia.values, strict=True)
    ):
        i = joint.body.inertia
        full = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
        opened += (
            f'<body pos="{text(joint.origin.position)}" quat="{quaternion(joint.origin.rotation)}">'
            f'<joint name="j{number}" type="hinge" axis="{text(joint.axis)}" armature="{armature}"/>'
            f'<inertial pos="{text(joint.body.centre_of_mass)}" mass="{joint.body.mass}" fullinertia="{text(full)}"/>'
        )
        inner += "</body>"
    tip = f'<geom name="tip" type="sphere" size="{RADIUS}" pos="{text(sphere)}" mass="0"/>'
    carriage = (
        f'<joint name="body" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="{body_mass}" diaginertia="1 1 1"/>'
    )
    pads = (
        f'<body pos="{text(point - [0, 0, THICK])}">{carriage if np.isfinite(body_mass) else ""}'
        f'<body><joint name="device" type="slide" axis="0 0 1" stiffness="75000"/><inertial pos="0 0 0" mass="{PLATE}" '
        'diaginertia="1e-5 1e-5 1e-5"/>'
        f'<body><joint name="pad" type="slide" axis="0 0 1" stiffness="{virtual.pad_stiffness}" '
        f'damping="{virtual.pad_damping}"/><geom name="plate" type="box" size="0.2 0.2 {THICK}" mass="{PLATE}"/>'
        "</body></body></body>"
    )
    return f"""<mujoco><compiler angle="radian" autolimits="false"/>
      <option timestep="{STEP}" gravity="0 0 0" integrator="implicitfast" iterations="100"/>
      <default><geom condim="1" solref="{4 * STEP} 1" solimp="0.99 0.999 0.0001" contype="0" conaffinity="0"/></default>
      <worldbody>{opened}{tip}{inner}{pads}</worldbody>
      <contact><pair geom1="tip" geom2="plate" condim="1" solref="{4 * STEP} 1" solimp="0.99 0.999 0.0001"/></contact>
    </mujoco>"""


def posed(mjcf, positions):
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    data.qpos[: len(positions)] = positions
    mujoco.mj_forward(model, data)
    return model, data


def device_force(virtual, positions, speed, duration, body_mass=np.inf):
    """Force on the device [N] from first contact on, a row every STEP, for one posture; fixed, or on a free mass."""
    n = len(positions)
    spring = n + int(np.isfinite(body_mass))
    flange = virtual.robot.flange.position + virtual.robot.flange.rotation @ virtual.robot.contact_offset
    model, data = posed(scene(virtual, flange, np.array([0, 0, 9.0]), body_mass), positions)
    last = n  # the world is body 0
    rotation, origin = data.xmat[last].reshape(3, 3), data.xpos[last]
    point = origin + rotation @ flange - [0, 0, virtual.contact_radius]
    sphere = rotation.T @ (point - origin + np.array([0, 0, RADIUS]))  # its lowest point is the contact point
    model, data = posed(scene(virtual, sphere, point, body_mass), positions)
    jp, jr = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, jp, jr, point, last)
    motion = np.linalg.pinv(np.vstack([jp, jr])[:, :n]) @ [0, 0, -1, 0, 0, 0]
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    own = np.diag(inertia)[:n]
    w, z, reaction = 2 * np.pi * virtual.servo.frequency, virtual.servo.damping, virtual.reaction
    data.qvel[:n] = motion * speed
    path, torque, begun, forces = 0.0, np.zeros(n), np.inf, []
    for step in range(round(duration / STEP)):
        now = step * STEP
        force = -75_000.0 * data.qpos[spring]
        forces.append(force)
        torque += (np.abs(jp[2, :n]) * force - torque) * STEP / reaction.torque_filter
        if begun == np.inf and torque.max() > reaction.threshold:
            begun = now + reaction.delay
        since = now - begun
        if since < 0:
            commanded = speed
        elif reaction.kind == "retreat":
            t, back = min(since, reaction.retreat_time), reaction.retreat_speed
            commanded = -back + (speed + back) * np.exp(-t / reaction.time_constant)
            commanded *= np.exp(-max(since - reaction.retreat_time, 0) / reaction.time_constant)
        else:
            hold, fade = reaction.yielding * (reaction.hold_force - force), np.exp(-since / reaction.time_constant)
            commanded = hold + (speed - hold) * fade
        error = positions + motion * path - data.qpos[:n]
        rate = motion * commanded - data.qvel[:n]
        data.qfrc_applied[:n] = own * (w**2 * error + 2 * z * w * rate)
        path += STEP * commanded
        mujoco.mj_step(model, data)
    return np.array(forces)
