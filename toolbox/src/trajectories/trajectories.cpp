#include "trajectories/trajectories.hpp"
#include "bf/trajectory/cartesian_trajectory.hpp"
#include "bf/trajectory/joint_trajectory.hpp"
#include "checks.hpp"

#include <algorithm>

namespace bf::toolbox {

namespace {

using trajectory::FrameMotion;
using Planned = trajectory::JointTrajectory;
using Path = trajectory::CartesianTrajectory::Path;

/// A trajectory is known by the state in which it began: a new target begins another one in the present
/// state.
class JointTrajectory final : public Block {
  public:
    using Block::Block;
    Argument<std::string> timing{this,
                                 "timing",
                                 {.initial = "time_optimal",
                                  .doc = "time_optimal: the shortest time, by phases of constant jerk; "
                                         "minimum_jerk: polynomials of least jerk",
                                  .choices = {"time_optimal", "minimum_jerk"}}};
    Argument<std::string> synchronisation{
        this,
        "synchronisation",
        {.initial = "time",
         .doc =
             "of time_optimal: all elements arrive at the same time; phase: on the straight line to the "
             "target, from rest or from a motion along it, otherwise as time; none: each as soon as it can",
         .choices = {"time", "phase", "none"}}};

    Dim n{this, "n"};
    Input<Vector> target{this, "target", {.shape = {n}, .unit = any_unit, .doc = "where to go"}};
    Input<Vector> initial{
        this,
        "initial",
        {.shape = {n},
         .unit = any_unit,
         .doc = "where the first step rests, such as the measured positions; open: at the target",
         .optional = true}};
    Parameter<Vector> max_velocity{
        this,
        "max_velocity",
        {.shape = {n}, .initial = {1}, .above = 0, .unit = any_unit, .doc = "of each element, 1/s"}};
    Parameter<Vector> max_acceleration{
        this,
        "max_acceleration",
        {.shape = {n}, .initial = {5}, .above = 0, .unit = any_unit, .doc = "of each element, 1/s2"}};
    Parameter<Vector> max_jerk{
        this,
        "max_jerk",
        {.shape = {n}, .initial = {100}, .above = 0, .unit = any_unit, .doc = "of each element, 1/s3"}};
    Parameter<double> shortest{
        this,
        "shortest",
        {.initial = {0}, .minimum = 0, .maximum = 3600, .unit = unit<"s">, .doc = "least time to a target"}};
    Output<Vector> position{this, "position", {.shape = {n}, .unit = any_unit, .doc = "on the way"}};
    Output<Vector> velocity{this, "velocity", {.shape = {n}, .unit = any_unit, .doc = "its rate, 1/s"}};
    Output<Vector> acceleration{
        this, "acceleration", {.shape = {n}, .unit = any_unit, .doc = "rate of the velocity, 1/s2"}};
    Output<double> remaining{
        this, "remaining", {.unit = unit<"s">, .doc = "time to the target; 0: it is reached"}};
    DiscreteState<Matrix> start{
        this,
        "start",
        {.shape = {n, 3}, .unit = any_unit, .doc = "position, velocity and acceleration where it began"}};
    DiscreteState<Matrix> task{
        this,
        "task",
        {.shape = {n, 4}, .unit = any_unit, .doc = "its target and limits of velocity, acceleration, jerk"}};
    DiscreteState<double> least{this, "least", {.unit = unit<"s">, .doc = "its least time"}};
    DiscreteState<double> elapsed{this, "elapsed", {.unit = unit<"s">, .doc = "since it began"}};
    DiscreteState<bool> goes_on{this, "goes_on", {.doc = "there is a trajectory"}};
    /// That of the step before, and that of this step.
    struct Pair {
        Planned before, now;
        Vector p, v, a;
    };
    Scratch<Pair> planned{
        this, [this] {
            const auto of =
                *timing == "minimum_jerk" ? Planned::Timing::minimum_jerk : Planned::Timing::time_optimal;
            const auto how = *synchronisation == "phase"  ? Planned::Synchronisation::phase
                             : *synchronisation == "none" ? Planned::Synchronisation::none
                                                          : Planned::Synchronisation::time;
            const Vector zero = Vector::Zero(value(n));
            return Pair{Planned(value(n), of, how), Planned(value(n), of, how), zero, zero, zero};
        }};

    Status output(Now at, Out out) const noexcept override {
        if (!(at.period() > 0)) return Status::failure("a continuous block has no period; give it one");
        if (const Status good = all_finite(at, target, initial); !good) return good;
        double t = 0;
        switch (find(at, t)) {
        case Planned::Status::bad_limits:
            return *timing == "minimum_jerk"
                       ? Status::failure("the limits allow no time, as all are infinite; give one that is "
                                         "finite, or a shortest time")
                       : Status::failure("the limits allow no time: velocities must be finite, and "
                                         "accelerations too where jerks are");
        case Planned::Status::not_found:
            return Status::failure("no motion to the target was found; look at a target that is very far "
                                   "away, or at limits that are many orders of magnitude apart");
        case Planned::Status::not_finite: return Status::failure("the trajectory is not finite; reset it");
        case Planned::Status::planned: break;
        }
        const Planned& now = at[planned].now;
        now.at(t, out[position], out[velocity], out[acceleration]);
        out[remaining] = std::max(0.0, now.duration() - t);
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        double t = 0;
        find(at, t);
        const auto& q = at[planned].now.question;
        next[start].col(0) = q.position;
        next[start].col(1) = q.velocity;
        next[start].col(2) = q.acceleration;
        next[task].col(0) = q.target;
        next[task].col(1) = q.max_velocity;
        next[task].col(2) = q.max_acceleration;
        next[task].col(3) = q.max_jerk;
        next[least] = q.shortest;
        next[elapsed] = t + at.period();
        next[goes_on] = true;
        return ok;
    }

  private:
    /// Plans the trajectory of this step; t is the time on it.
    Planned::Status find(Now at, double& t) const noexcept {
        Pair& pair = at[planned];
        auto& now = pair.now.question;
        now.target = at[target];
        now.max_velocity = at[max_velocity];
        now.max_acceleration = at[max_acceleration];
        now.max_jerk = at[max_jerk];
        now.shortest = at[shortest];
        now.velocity.setZero();
        now.acceleration.setZero();
        t = 0;
        if (!at[goes_on]) {
            now.position = at.is_connected(initial) ? at[initial] : at[target];
            return pair.now.plan();
        }
        const auto began = at[start], was = at[task];
        const bool is_same = now.target == was.col(0) && now.max_velocity == was.col(1) &&
                             now.max_acceleration == was.col(2) && now.max_jerk == was.col(3) &&
                             now.shortest == at[least];
        if (is_same) {
            now.position = began.col(0);
            now.velocity = began.col(1);
            now.acceleration = began.col(2);
            t = at[elapsed];
            return pair.now.plan();
        }
        auto& old = pair.before.question;
        old.position = began.col(0);
        old.velocity = began.col(1);
        old.acceleration = began.col(2);
        old.target = was.col(0);
        old.max_velocity = was.col(1);
        old.max_acceleration = was.col(2);
        old.max_jerk = was.col(3);
        old.shortest = at[least];
        const auto status = pair.before.plan();
        if (status != Planned::Status::planned) return status;
        pair.before.at(at[elapsed], pair.p, pair.v, pair.a);
        now.position = pair.p;
        now.velocity = pair.v;
        now.acceleration = pair.a;
        return pair.now.plan();
    }
};

class CartesianTrajectory final : public Block {
  public:
    using Block::Block;
    Argument<std::string> path{this,
                               "path",
                               {.initial = "straight",
                                .doc = "straight: the origin on a line, the shortest rotation; screw: the "
                                       "geodesic of SE(3), which turns about one axis",
                                .choices = {"straight", "screw"}}};
    Input<Transform> target{
        this, "w_H_target", {.unit = mixed_units, .doc = "where to go, pose in the world"}};
    Input<Transform> initial{this,
                             "w_H_0",
                             {.initial = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                              .unit = mixed_units,
                              .doc = "where the first step rests; open: at the target",
                              .optional = true}};
    Parameter<double> duration{this,
                               "duration",
                               {.initial = {1},
                                .minimum = 0,
                                .maximum = 3600,
                                .unit = unit<"s">,
                                .doc = "of the way to a target; longer where the speeds need it"}};
    Parameter<double> max_speed{this,
                                "max_speed",
                                {.initial = {bf::Limits::infinity},
                                 .above = 0,
                                 .unit = unit<"m/s">,
                                 .doc = "of the origin, on straight ways from rest"}};
    Parameter<double> max_angular_speed{this,
                                        "max_angular_speed",
                                        {.initial = {bf::Limits::infinity},
                                         .above = 0,
                                         .unit = unit<"rad/s">,
                                         .doc = "of the rotation, on ways from rest"}};
    Output<Transform> w_H{this, "w_H", {.unit = mixed_units, .doc = "pose on the way, in the world"}};
    Output<Vector6> v{
        this,
        "v",
        {.unit = mixed_units, .doc = "velocity, mixed: origin [m/s], angular [rad/s], world axes"}};
    Output<Vector6> a{
        this,
        "a",
        {.unit = mixed_units, .doc = "acceleration, mixed: origin [m/s2], angular [rad/s2], world axes"}};
    Output<double> remaining{
        this, "remaining", {.unit = unit<"s">, .doc = "time to the target; 0: it is reached"}};
    DiscreteState<Transform> w_H_start{
        this, "w_H_start", {.unit = mixed_units, .doc = "pose where the trajectory began"}};
    DiscreteState<Vector6> v_start{this, "v_start", {.unit = mixed_units, .doc = "and velocity"}};
    DiscreteState<Vector6> a_start{this, "a_start", {.unit = mixed_units, .doc = "and acceleration"}};
    DiscreteState<Transform> w_H_goal{this, "w_H_goal", {.unit = mixed_units, .doc = "its target"}};
    DiscreteState<double> T{this, "T", {.unit = unit<"s">, .doc = "its duration"}};
    DiscreteState<double> elapsed{this, "elapsed", {.unit = unit<"s">, .doc = "since it began"}};
    DiscreteState<bool> goes_on{this, "goes_on", {.doc = "there is a trajectory"}};

    Status output(Now at, Out out) const noexcept override {
        if (!(at.period() > 0)) return Status::failure("a continuous block has no period; give it one");
        Status good = all_finite(at, target, initial);
        if (good) good = is_rotation(at, target);
        if (good && at.is_connected(initial)) good = is_rotation(at, initial);
        if (!good) return good;
        const Present now = find(at);
        const FrameMotion motion = along(now).at(now.t);
        out[w_H] = motion.pose;
        out[v] = motion.velocity;
        out[a] = motion.acceleration;
        out[remaining] = std::max(0.0, now.T - now.t);
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        const Present now = find(at);
        next[w_H_start] = now.start.pose;
        next[v_start] = now.start.velocity;
        next[a_start] = now.start.acceleration;
        next[w_H_goal] = now.goal;
        next[T] = now.T;
        next[elapsed] = now.t + at.period();
        next[goes_on] = true;
        return ok;
    }

  private:
    struct Present {
        FrameMotion start;
        Transform goal;
        double T, t; ///< s
    };
    trajectory::CartesianTrajectory along(const Present& p) const {
        return {p.start, p.goal, *path == "screw" ? Path::screw : Path::straight, p.T};
    }
    /// The trajectory of this step and the time on it.
    Present find(Now at) const {
        Present now{{at[w_H_start], at[v_start], at[a_start]}, at[target], at[T], at[elapsed]};
        if (!at[goes_on]) {
            now.start = {at.is_connected(initial) ? Transform(at[initial]) : now.goal, Vector6::Zero(),
                         Vector6::Zero()};
        } else if (now.goal == at[w_H_goal]) {
            return now;
        } else {
            Present before = now;
            before.goal = at[w_H_goal];
            now.start = along(before).at(before.t);
        }
        now.t = 0;
        now.T = std::max(at[duration], trajectory::CartesianTrajectory::shortest(
                                           now.start.pose, now.goal, at[max_speed], at[max_angular_speed]));
        return now;
    }
};

} // namespace

void add_trajectories(Library& library) {
    library.group("trajectories")
        .add<JointTrajectory>(
            "JointTrajectory",
            "A vector, such as joint positions, moves from rest to its target within limits of velocity, "
            "acceleration and jerk: in the shortest time, or by polynomials of least jerk, whose duration is "
            "the shortest that the limits allow. When the target or a limit changes on the way, it goes on "
            "from its present position, velocity and acceleration; what is then beyond its limits is braked. "
            "Where no polynomial of minimum_jerk to the target keeps the limits, one first brings each "
            "element to rest within them, or within what velocity and acceleration are already. It starts at "
            "rest at `initial`. Sources: L. Berscheid, T. Kröger, Jerk-limited real-time trajectory "
            "generation with arbitrary target states, 2021; T. Flash, N. Hogan, The coordination of arm "
            "movements, 1985. Errors: an input that is not finite, limits that allow no time, no period.")
        .add<CartesianTrajectory>(
            "CartesianTrajectory",
            "A pose moves from rest to its target by coordinates of least jerk, along a straight line with "
            "the shortest rotation or along a screw, with the velocity and acceleration that a CartesianTask "
            "takes. When the target changes on the way, it goes on from its present pose, velocity and "
            "acceleration. It starts at rest at w_H_0. Source: M. Žefran, V. Kumar, C. B. Croke, On the "
            "generation of smooth three-dimensional rigid body motions, 1998. Errors: a pose that is not "
            "finite, or whose rotation is none; no period.");
}

} // namespace bf::toolbox
