"""Drake: primitives in C++, wired from Python; the simulator runs without Python."""
import numpy as np
from pydrake.symbolic import Variable
import pydrake.math
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Adder, ConstantVectorSource, Gain, MatrixGain, SymbolicVectorSystem, ZeroOrderHold

from common import CARTPOLE, CHAIN, cart_pole, measure


def start(diagram, context, h, output, integrator=None):
    simulator = Simulator(diagram, context)
    if integrator:
        scheme = ResetIntegratorFromFlags(simulator, integrator, h)
        scheme.set_fixed_step_mode(True)
    simulator.Initialize()
    done = 0

    # Updates happen at 0, h, 2h, ...; half a step less keeps rounding from adding one.
    def advance(n):
        nonlocal done
        done += n
        simulator.AdvanceTo((done - 0.5) * h if not integrator else done * h)

    return advance, lambda: float(output.Eval(output_context(diagram, simulator, output))[0]), 0.0


def output_context(diagram, simulator, output):
    return output.get_system().GetMyContextFromRoot(simulator.get_mutable_context())


def chain(width):
    h = 1 / 1024  # exact in binary
    builder = DiagramBuilder()
    one = builder.AddSystem(ConstantVectorSource(CHAIN["constant"] * np.ones(width)))
    delays = [builder.AddSystem(ZeroOrderHold(h, width)) for _ in range(CHAIN["delays"])]
    last = delays[-1]
    for _ in range(CHAIN["pairs"]):
        gain = builder.AddSystem(Gain(CHAIN["gain"], width))
        total = builder.AddSystem(Adder(2, width))
        builder.Connect(last.get_output_port(), gain.get_input_port())
        builder.Connect(gain.get_output_port(), total.get_input_port(0))
        builder.Connect(one.get_output_port(), total.get_input_port(1))
        last = total
    output = last.get_output_port()
    for delay in delays:
        builder.Connect(last.get_output_port(), delay.get_input_port())
        last = delay
    diagram = builder.Build()
    return start(diagram, diagram.CreateDefaultContext(), h, output)


def cart_pole_loop():
    builder = DiagramBuilder()
    x, force = [Variable(name) for name in ("p", "theta", "v", "omega")], Variable("force")
    plant = builder.AddSystem(
        SymbolicVectorSystem(state=x, input=[force], dynamics=cart_pole(x, force, pydrake.math), output=x))
    gain = builder.AddSystem(MatrixGain(-np.array([CARTPOLE["K"]])))
    hold = builder.AddSystem(ZeroOrderHold(CARTPOLE["period"], 1))
    angle = builder.AddSystem(MatrixGain(np.array([[0.0, 1, 0, 0]])))
    builder.Connect(plant.get_output_port(), gain.get_input_port())
    builder.Connect(plant.get_output_port(), angle.get_input_port())
    builder.Connect(gain.get_output_port(), hold.get_input_port())
    builder.Connect(hold.get_output_port(), plant.get_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant.GetMyContextFromRoot(context).SetContinuousState([0, CARTPOLE["theta"], 0, 0])
    return start(diagram, context, CARTPOLE["step"], angle.get_output_port(), "runge_kutta3")


measure(chain, cart_pole_loop)
