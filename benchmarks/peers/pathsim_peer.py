"""PathSim: blocks in Python."""
import math

import numpy as np
from pathsim import Connection, Simulation
from pathsim.blocks import ODE, Adder, Amplifier, Constant, Delay, Function, SampleHold
from pathsim.solvers import EUF, RK4

from common import CARTPOLE, CHAIN, cart_pole, measure


def start(blocks, connections, h, solver, check):
    simulation = Simulation(blocks, connections, dt=h, Solver=solver, log=False)
    return lambda n: simulation.run(n * h, adaptive=False), check, 0.0


def chain(width):
    h = 1 / 1024  # exact in binary
    every = slice(0, width)  # a port carries one number: a vector is as many ports
    one = Constant(CHAIN["constant"])
    delays = [Delay(tau=h) for _ in range(CHAIN["delays"])]
    blocks, connections, last = [one, *delays], [], delays[-1]
    for _ in range(CHAIN["pairs"]):
        gain = Amplifier(gain=CHAIN["gain"])
        total = Adder() if width == 1 else Function(lambda constant, *u: constant + np.array(u))
        blocks += [gain, total]
        connections += [Connection(last[every], gain[every]), Connection(one, total[0]),
                        Connection(gain[every], total[1:width + 1])]
        last = total
    output = last
    for delay in delays:
        connections.append(Connection(last[every], delay[every]))
        last = delay
    return start(blocks, connections, h, EUF, lambda: float(output.outputs[0]))


def cart_pole_loop():
    K, all_of_x = np.array(CARTPOLE["K"]), slice(0, 4)
    plant = ODE(lambda x, u, t: np.array(cart_pole(x, u[0], math)), np.array([0, CARTPOLE["theta"], 0, 0]))
    hold = SampleHold(T=CARTPOLE["period"])
    regulator = Function(lambda *x: -K @ np.array(x))
    connections = [Connection(plant[all_of_x], hold[all_of_x]), Connection(hold[all_of_x], regulator[all_of_x]),
                   Connection(regulator, plant)]
    return start([plant, hold, regulator], connections, CARTPOLE["step"], RK4, lambda: float(plant.outputs[1]))


measure(chain, cart_pole_loop)
