//! A graph of tasks has no loops, so the last task leaves its value where the first one finds it one iteration later.
use crate::case::{GRAVITY, HORIZON, K, LENGTH, MASSES, STEP, THETA, WIDTH};
use cu29::prelude::*;
use std::cell::Cell;

pub type Signal = [f64; WIDTH];

thread_local! {
    static BACK: Cell<Signal> = const { Cell::new([0.0; WIDTH]) };
    pub static CHECK: Cell<f64> = const { Cell::new(0.0) };
}

fn number(config: Option<&ComponentConfig>, key: &str) -> CuResult<f64> {
    let value = config.and_then(|config| config.get::<f64>(key).transpose()).transpose()?;
    value.ok_or_else(|| CuError::from(format!("'{key}' is missing in the configuration")))
}

fn value<T: CuMsgPayload + Copy>(message: &CuMsg<T>) -> T {
    *message.payload().unwrap()
}

/// The constant.
#[derive(Reflect)]
pub struct Constant(f64);
impl Freezable for Constant {}
impl CuSrcTask for Constant {
    type Resources<'r> = ();
    type Output<'m> = output_msg!(Signal);
    fn new(config: Option<&ComponentConfig>, _: ()) -> CuResult<Self> {
        Ok(Self(number(config, "value")?))
    }
    fn process(&mut self, _: &CuContext, y: &mut Self::Output<'_>) -> CuResult<()> {
        y.set_payload([self.0; WIDTH]);
        Ok(())
    }
}

/// The last delay's output.
#[derive(Reflect)]
pub struct Back;
impl Freezable for Back {}
impl CuSrcTask for Back {
    type Resources<'r> = ();
    type Output<'m> = output_msg!(Signal);
    fn new(_: Option<&ComponentConfig>, _: ()) -> CuResult<Self> {
        Ok(Self)
    }
    fn process(&mut self, _: &CuContext, y: &mut Self::Output<'_>) -> CuResult<()> {
        y.set_payload(BACK.get());
        Ok(())
    }
}

#[derive(Reflect)]
pub struct Gain(f64);
impl Freezable for Gain {}
impl CuTask for Gain {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(Signal);
    type Output<'m> = output_msg!(Signal);
    fn new(config: Option<&ComponentConfig>, _: ()) -> CuResult<Self> {
        Ok(Self(number(config, "k")?))
    }
    fn process(&mut self, _: &CuContext, u: &Self::Input<'_>, y: &mut Self::Output<'_>) -> CuResult<()> {
        y.set_payload(value(u).map(|u| self.0 * u));
        Ok(())
    }
}

#[derive(Reflect)]
pub struct Sum;
impl Freezable for Sum {}
impl CuTask for Sum {
    type Resources<'r> = ();
    type Input<'m> = input_msg!('m, Signal, Signal);
    type Output<'m> = output_msg!(Signal);
    fn new(_: Option<&ComponentConfig>, _: ()) -> CuResult<Self> {
        Ok(Self)
    }
    fn process(&mut self, _: &CuContext, u: &Self::Input<'_>, y: &mut Self::Output<'_>) -> CuResult<()> {
        let (u1, u2) = (value(u.0), value(u.1));
        y.set_payload(std::array::from_fn(|i| u1[i] + u2[i]));
        Ok(())
    }
}

#[derive(Reflect)]
pub struct Delay(#[reflect(ignore)] Signal);
impl Freezable for Delay {}
impl CuTask for Delay {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(Signal);
    type Output<'m> = output_msg!(Signal);
    fn new(_: Option<&ComponentConfig>, _: ()) -> CuResult<Self> {
        Ok(Self([0.0; WIDTH]))
    }
    fn process(&mut self, _: &CuContext, u: &Self::Input<'_>, y: &mut Self::Output<'_>) -> CuResult<()> {
        y.set_payload(self.0);
        self.0 = value(u);
        Ok(())
    }
}

/// The last delay; reads the last sum, too.
#[derive(Reflect)]
pub struct LastDelay;
impl Freezable for LastDelay {}
impl CuSinkTask for LastDelay {
    type Resources<'r> = ();
    type Input<'m> = input_msg!('m, Signal, Signal);
    fn new(_: Option<&ComponentConfig>, _: ()) -> CuResult<Self> {
        Ok(Self)
    }
    fn process(&mut self, _: &CuContext, u: &Self::Input<'_>) -> CuResult<()> {
        BACK.set(value(u.0));
        CHECK.set(value(u.1)[0]);
        Ok(())
    }
}

type State = [f64; 4];

/// Time derivative of [position, angle from upright, velocity, angular velocity].
fn cart_pole(x: &State, force: f64) -> State {
    let (sin, cos) = x[1].sin_cos();
    let [cart, pole] = MASSES;
    let acceleration = (force + pole * sin * (LENGTH * x[3] * x[3] - GRAVITY * cos)) / (cart + pole * sin * sin);
    [x[2], x[3], acceleration, (GRAVITY * sin - acceleration * cos) / LENGTH]
}

/// Copper has no solver: the plant brings its own Runge-Kutta steps from one control period to the next.
#[derive(Reflect)]
pub struct Plant {
    #[reflect(ignore)]
    x: State,
    started: bool,
}
impl Freezable for Plant {}
impl CuSrcTask for Plant {
    type Resources<'r> = ();
    type Output<'m> = output_msg!(State);
    fn new(_: Option<&ComponentConfig>, _: ()) -> CuResult<Self> {
        Ok(Self { x: [0.0, THETA, 0.0, 0.0], started: false })
    }
    fn process(&mut self, _: &CuContext, y: &mut Self::Output<'_>) -> CuResult<()> {
        let force = BACK.get()[0];
        for _ in 0..if self.started { HORIZON } else { 0 } {
            let moved = |k: &State, h: f64| -> State { std::array::from_fn(|i| self.x[i] + h * k[i]) };
            let k1 = cart_pole(&self.x, force);
            let k2 = cart_pole(&moved(&k1, STEP / 2.0), force);
            let k3 = cart_pole(&moved(&k2, STEP / 2.0), force);
            let k4 = cart_pole(&moved(&k3, STEP), force);
            for i in 0..4 {
                self.x[i] += STEP / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        self.started = true;
        CHECK.set(self.x[1]);
        y.set_payload(self.x);
        Ok(())
    }
}

/// force = -K x
#[derive(Reflect)]
pub struct Regulator;
impl Freezable for Regulator {}
impl CuTask for Regulator {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(State);
    type Output<'m> = output_msg!(f64);
    fn new(_: Option<&ComponentConfig>, _: ()) -> CuResult<Self> {
        Ok(Self)
    }
    fn process(&mut self, _: &CuContext, x: &Self::Input<'_>, force: &mut Self::Output<'_>) -> CuResult<()> {
        let x = value(x);
        force.set_payload(-(0..4).map(|i| K[i] * x[i]).sum::<f64>());
        Ok(())
    }
}

#[derive(Reflect)]
pub struct Actuator;
impl Freezable for Actuator {}
impl CuSinkTask for Actuator {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(f64);
    fn new(_: Option<&ComponentConfig>, _: ()) -> CuResult<Self> {
        Ok(Self)
    }
    fn process(&mut self, _: &CuContext, force: &Self::Input<'_>) -> CuResult<()> {
        BACK.set([value(force); WIDTH]);
        Ok(())
    }
}
