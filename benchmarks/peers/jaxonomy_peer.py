"""Jaxonomy: the whole diagram is compiled by XLA, once per process."""
import sys
import time

import jax
import jax.numpy as jnp
import jaxonomy
from jaxonomy.library import Adder, Constant, FeedthroughBlock, Gain, UnitDelay, ZeroOrderHold
from jaxonomy.models.cartpole import CartPole
from jaxonomy.simulation import Simulator, SimulatorOptions

from common import CARTPOLE, CHAIN, cart_pole, measure

sys.setrecursionlimit(100_000)  # a long chain is evaluated by recursion
jax.config.update("jax_enable_x64", True)


def start(diagram, h, check, **options):
    context = diagram.create_context()
    simulator = Simulator(diagram, options=SimulatorOptions(save_time_series=False, **options))
    reached = context

    # From the start each time: a context that was reached has had its updates and cannot go on.
    def advance(n):
        nonlocal reached
        reached = jax.block_until_ready(simulator.advance_to(n * h, context)).context

    begin = time.process_time()
    advance(1)
    return advance, lambda: check(reached), time.process_time() - begin


def chain(width):
    h = 1 / 1024
    builder = jaxonomy.DiagramBuilder()
    one = builder.add(Constant(CHAIN["constant"] * jnp.ones(width)))
    delays = [builder.add(UnitDelay(h, initial_state=jnp.zeros(width))) for _ in range(CHAIN["delays"])]
    last = delays[-1]
    for _ in range(CHAIN["pairs"]):
        gain = builder.add(Gain(CHAIN["gain"]))
        total = builder.add(Adder(2))
        builder.connect(last.output_ports[0], gain.input_ports[0])
        builder.connect(gain.output_ports[0], total.input_ports[0])
        builder.connect(one.output_ports[0], total.input_ports[1])
        last = total
    output = last.output_ports[0]
    for delay in delays:
        builder.connect(last.output_ports[0], delay.input_ports[0])
        last = delay
    return start(builder.build(), h, lambda context: float(output.eval(context)[0]))


class Plant(jaxonomy.LeafSystem):
    def __init__(self):
        super().__init__()
        self.declare_input_port()
        self.declare_continuous_state(shape=(4,), ode=self.ode, default_value=jnp.array([0, CARTPOLE["theta"], 0, 0.0]))
        self.declare_continuous_state_output()

    def ode(self, _time, state, force):
        return jnp.stack(cart_pole(state.continuous_state, force, jnp))


def cart_pole_loop():
    builder = jaxonomy.DiagramBuilder()
    plant, hold = builder.add(Plant()), builder.add(ZeroOrderHold(CARTPOLE["period"]))
    K = jnp.array(CARTPOLE["K"])
    regulator = builder.add(FeedthroughBlock(lambda x: -K @ x))
    builder.connect(plant.output_ports[0], hold.input_ports[0])
    builder.connect(hold.output_ports[0], regulator.input_ports[0])
    builder.connect(regulator.output_ports[0], plant.input_ports[0])
    return start(builder.build(), CARTPOLE["step"], lambda context: float(plant.output_ports[0].eval(context)[1]),
                 ode_solver_method="rk4", max_minor_step_size=CARTPOLE["step"])


measure(chain, cart_pole_loop)
