#include "walking/walking.hpp"

#include "bf/core/block.hpp"
#include "bf/walking/dcm.hpp"
#include "bf/walking/swing.hpp"
#include "checks.hpp"
#include "world/terrain.hpp"

#include <algorithm>
#include <cmath>

namespace bf::toolbox {

namespace {

using walking::Foothold;
using walking::Side;
using walking::Step;

constexpr int max_preview = 16;
constexpr const char* footholds_doc =
    "columns [x y z yaw] of soles: the foot that moves, where it comes from; the foot that stands; where the "
    "first one goes; the steps after it [m, rad]";
constexpr const char* step_doc =
    "of the step: time in it, duration on both feet, on one foot, and both in the next one [s], the "
    "standing foot (1 left, 2 right), "
    "how many steps are planned, this one included (0: it stands), whether the weight begins midway (1 or 0)";

Dim::Names step_names() {
    return std::vector<std::string>{
        "time",   "double_support", "single_support", "next_double_support", "next_single_support",
        "stance", "ahead",          "from_rest"};
}

/// Blocks that follow a FootstepPlanner.
class StepBlock : public Block {
  public:
    using Block::Block;
    Dim k{this, "k"};
    Dim numbers{this, "step", [] { return step_names(); }};
    Input<Matrix> footholds{this, "footholds", {.shape = {4, k}, .unit = mixed_units, .doc = footholds_doc}};
    Input<Vector> step{this, "step", {.shape = {numbers}, .unit = mixed_units, .doc = step_doc}};

  protected:
    /// Reads both inputs.
    Status read(Now at, Step& now) const {
        if (const Status good = all_finite(at, footholds, step); !good) return good;
        if (!Step::read(at[step], now))
            return Status::failure("{element} is no step: a time, a duration or a count is below zero, or "
                                   "stance neither 1 nor 2; wire a FootstepPlanner",
                                   step, -1);
        if (now.ahead + 2 > static_cast<int>(at[footholds].cols()) || at[footholds].cols() < 3)
            return Status::failure("the step plans {} steps, but there are {} footholds; wire those of the "
                                   "same FootstepPlanner",
                                   now.ahead, static_cast<std::int32_t>(at[footholds].cols()));
        return ok;
    }
};

class FootstepPlanner final : public Block {
  public:
    explicit FootstepPlanner(const Arguments& arguments)
        : Block(arguments), terrain_(terrain->empty() ? "" : path_of(*terrain)) {}
    Argument<std::string> follow{
        this,
        "follow",
        {.initial = "velocity",
         .doc = "what the command is: a velocity in body axes, or a goal in the world",
         .choices = {"velocity", "goal"}}};
    Argument<int> preview{
        this,
        "preview",
        {.initial = 4, .minimum = 1, .maximum = max_preview, .doc = "most steps that are planned ahead"}};
    Argument<std::string> first_foot{
        this, "first_foot", {.initial = "left", .doc = "that moves first", .choices = {"left", "right"}}};
    Argument<Matrix> ground{this,
                            "ground",
                            {.initial = Matrix(0, 6),
                             .doc = "boxes on the plane z = 0: rows x y z a b c, centre and half-sizes, m"}};
    Argument<std::string> terrain{
        this,
        "terrain",
        {.doc =
             "XML file of a world, as World and MujocoWorld read it, whose boxes and steps are ground, too"}};

    Dim k{this, "k", [this] { return *preview + 2; }};
    Dim numbers{this, "step", [] { return step_names(); }};
    Input<Transform> w_H_left{
        this,
        "w_H_left",
        {.unit = mixed_units, .doc = "pose of the left sole; read at the start and when the foot lands"}};
    Input<Transform> w_H_right{
        this,
        "w_H_right",
        {.unit = mixed_units, .doc = "pose of the right sole; read at the start and when the foot lands"}};
    Input<Vector3> command{this,
                           "command",
                           {.unit = mixed_units,
                            .doc = "velocity x y [m/s] and turning [rad/s] of the body, its axes; or goal x "
                                   "y [m] and yaw [rad] in the world"}};
    Input<Eigen::Vector2d> shift{
        this,
        "shift",
        {.unit = unit<"m">,
         .doc = "moves where the foot lands, x y in world axes, in each step of the block",
         .feedthrough = false,
         .optional = true}};
    Input<double> delay{this,
                        "delay",
                        {.unit = unit<"s">,
                         .doc = "by which the foot lands later, in each step of the block",
                         .feedthrough = false,
                         .optional = true}};
    Parameter<double> steps{this,
                            "steps",
                            {.initial = {Limits::infinity},
                             .minimum = 0,
                             .doc = "of the walk; the last one brings the feet side by side"}};
    Parameter<double> start_time{
        this,
        "start_time",
        {.initial = {1}, .minimum = 0, .unit = unit<"s">, .doc = "before the first step"}};
    Parameter<double> double_support{this,
                                     "double_support",
                                     {.initial = {0.25},
                                      .above = 0,
                                      .maximum = largest,
                                      .unit = unit<"s">,
                                      .doc = "duration on both feet"}};
    Parameter<double> first_double_support{
        this,
        "first_double_support",
        {.initial = {1},
         .above = 0,
         .unit = unit<"s">,
         .doc = "duration on both feet in the first step, which begins at rest"}};
    Parameter<double> single_support{
        this,
        "single_support",
        {.initial = {0.6}, .above = 0, .maximum = largest, .unit = unit<"s">, .doc = "duration on one foot"}};
    Parameter<double> min_single_support{this,
                                         "min_single_support",
                                         {.initial = {0.3},
                                          .minimum = 0,
                                          .maximum = largest,
                                          .unit = unit<"s">,
                                          .doc = "to which delay may shorten it"}};
    Parameter<double> max_single_support{this,
                                         "max_single_support",
                                         {.initial = {1},
                                          .minimum = 0,
                                          .maximum = largest,
                                          .unit = unit<"s">,
                                          .doc = "to which delay may lengthen it"}};
    Parameter<double> width{
        this, "width", {.initial = {0.15}, .above = 0, .unit = unit<"m">, .doc = "between the soles"}};
    Parameter<double> max_forward{
        this, "max_forward", {.initial = {0.2}, .minimum = 0, .unit = unit<"m">, .doc = "step length"}};
    Parameter<double> max_backward{
        this, "max_backward", {.initial = {0.1}, .minimum = 0, .unit = unit<"m">, .doc = "step length"}};
    Parameter<double> min_width{
        this,
        "min_width",
        {.initial = {0.1}, .above = 0, .unit = unit<"m">, .doc = "between the soles while stepping"}};
    Parameter<double> max_width{this,
                                "max_width",
                                {.initial = {0.3},
                                 .above = 0,
                                 .at_least = min_width.index(),
                                 .unit = unit<"m">,
                                 .doc = "between the soles while stepping"}};
    Parameter<double> max_turn{this,
                               "max_turn",
                               {.initial = {0.3},
                                .minimum = 0,
                                .unit = unit<"rad">,
                                .doc = "of a step, outwards; a third of it inwards"}};
    Parameter<double> freeze{this,
                             "freeze",
                             {.initial = {0.1},
                              .minimum = 0,
                              .unit = unit<"s">,
                              .doc = "before landing, in which neither foothold nor time change"}};
    Parameter<Eigen::Vector2d> x{
        this,
        "x",
        {.initial = {-0.05, 0.1}, .unit = unit<"m">, .doc = "from and to: extent of a sole in its axes"}};
    Parameter<Eigen::Vector2d> y{
        this,
        "y",
        {.initial = {-0.03, 0.03}, .unit = unit<"m">, .doc = "from and to: extent of a sole in its axes"}};
    Parameter<double> clearance{
        this,
        "clearance",
        {.initial = {0.02}, .minimum = 0, .unit = unit<"m">, .doc = "of the soles from edges of the ground"}};

    Output<Matrix> footholds{this, "footholds", {.shape = {4, k}, .unit = mixed_units, .doc = footholds_doc}};
    Output<Vector> step{this, "step", {.shape = {numbers}, .unit = mixed_units, .doc = step_doc}};
    Output<Eigen::Vector2d> contacts{
        this, "contacts", {.doc = "1 where the left and the right foot stand, 0 where not"}};
    Output<double> steps_done{this, "steps_done", {.doc = "feet that have landed"}};
    DiscreteState<Eigen::Matrix<double, 4, 3>> feet{
        this, "feet", {.unit = mixed_units, .doc = "the first three footholds"}};
    DiscreteState<Vector> now{this, "now", {.shape = {numbers}, .unit = mixed_units, .doc = "the step"}};
    DiscreteState<double> done{this, "done", {.doc = "feet that have landed"}};

    void infer(Inference& inference) const override {
        try {
            Matrix boxes = *ground;
            if (!terrain_.empty()) {
                const Matrix more = read_boxes(terrain_);
                boxes.conservativeResize(boxes.rows() + more.rows(), 6);
                boxes.bottomRows(more.rows()) = more;
            }
            ground_ = walking::Ground(boxes);
        } catch (const std::invalid_argument& error) {
            inference.refuse(std::string("argument 'ground': ") + error.what());
        } catch (const std::exception& error) {
            inference.refuse(error.what());
        }
    }
    Status output(Now at, Out out) const noexcept override {
        Plan plan;
        if (const Status good = make(at, plan); !good) return good;
        out[footholds] = plan.footholds.leftCols(*preview + 2);
        out[step] = plan.step.numbers();
        const bool both = plan.step.on_both_feet(), left = plan.step.stance == Side::left;
        out[contacts] = Eigen::Vector2d(both || left ? 1 : 0, both || !left ? 1 : 0);
        out[steps_done] = at[done];
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        Plan plan;
        if (const Status good = make(at, plan); !good) return good;
        if (const Status good = all_finite(at, shift); !good) return good;
        if (!std::isfinite(at[delay]))
            return Status::failure("{element} is not finite; look at what computes it", delay, -1);
        Step& s = plan.step;
        auto lifted = plan.footholds.col(0), stance = plan.footholds.col(1), target = plan.footholds.col(2);
        const bool is_free = !s.on_both_feet() && s.duration() - s.time > at[freeze];
        // Twice as fast as planned at most, and never back, so that the foot in the air follows.
        if (is_free)
            s.single_support = std::clamp(s.single_support + std::clamp(at[delay], -at.period(), at.period()),
                                          std::max(std::min(at[min_single_support], s.single_support),
                                                   s.time + at[freeze] - s.double_support),
                                          std::max(at[max_single_support], s.single_support));
        if (is_free && !at[shift].isZero(0)) {
            Foothold moved = target;
            moved.head<2>() += at[shift];
            moved = walking::within_reach(moved, stance, s.stance, reach(at));
            // A foot in the air cannot go far aside of an edge; it keeps to where it goes.
            if (ground_.settle(moved, sole(at), at[clearance] / 2, 0, 0) && moved[2] == target[2])
                target = moved;
        }
        s.time += at.period();
        double landed = at[done];
        const double early = at.period() / 2; // durations end at the nearest step of the block
        const double wait = s.from_rest ? at[start_time] : s.double_support;
        if (s.ahead == 0 && s.time > wait - early) {
            begin(at, plan, landed, true);
        } else if (s.ahead > 0 && s.time > s.duration() - early) {
            landed += 1;
            Foothold there = walking::foothold_of(s.stance == Side::left ? at[w_H_right] : at[w_H_left]);
            there[2] = target[2]; // the ground is known better than how far the foot has come
            there[3] = target[3] + walking::wrapped(there[3] - target[3]);
            lifted = Foothold(stance);
            stance = there;
            s.stance = walking::other(s.stance);
            begin(at, plan, landed, false);
        }
        next[feet] = plan.footholds.leftCols<3>();
        next[now] = s.numbers();
        next[done] = landed;
        return ok;
    }

  private:
    struct Plan {
        Eigen::Matrix<double, 4, max_preview + 2> footholds;
        Step step;
    };
    /// Largest distance and turn of feet that stand as they should.
    static constexpr double near_m = 0.01, near_rad = 0.05;

    walking::Reach reach(Now at) const {
        return {at[max_forward], at[max_backward], at[min_width],
                at[max_width],   at[max_turn],     at[max_turn] / 3};
    }
    walking::Sole sole(Now at) const { return {at[x][0], at[x][1], at[y][0], at[y][1]}; }
    /// What a command asks for, brought within reach and onto level ground.
    Foothold placed(Now at, const Foothold& wanted, const Foothold& stance, Side side) const {
        Foothold foothold = walking::within_reach(wanted, stance, side, reach(at));
        const double whole = at[x][1] - at[x][0] + 2 * at[clearance];
        const double length = (Eigen::Rotation2Dd(-stance[3]) * (foothold - stance).head<2>()).x();
        ground_.settle(foothold, sole(at), at[clearance], std::min(whole, length + at[max_backward]),
                       std::min(whole, at[max_forward] - length));
        return foothold;
    }
    /// Where the foot at `moving` goes in step `number` (from 1) beside `stance`. False: it is there.
    bool next_step(Now at, const Foothold& moving, const Foothold& stance, Side side, double number,
                   Foothold& target) const {
        if (number > at[steps]) return false;
        Vector3 motion = Vector3::Zero();
        if (number + 1 <= at[steps]) {
            motion = *follow == "goal" ? walking::motion_to(at[command], stance, side, at[width])
                                       : Vector3(at[command] * (at[double_support] + at[single_support]));
        }
        const Foothold wanted = walking::next_foothold(stance, side, at[width], motion);
        target = placed(at, wanted, stance, side);
        return (target - moving).head<2>().norm() > near_m ||
               std::abs(walking::wrapped(target[3] - moving[3])) > near_rad;
    }
    /// The first step from where the feet of the plan stand, or none.
    void begin(Now at, Plan& plan, double landed, bool from_rest) const {
        Step& s = plan.step;
        Foothold target;
        const bool goes_on =
            next_step(at, plan.footholds.col(0), plan.footholds.col(1), s.stance, landed + 1, target);
        if (!goes_on && from_rest) return; // and waits
        s.time = 0;
        s.from_rest = from_rest;
        s.ahead = goes_on ? 1 : 0;
        s.double_support = from_rest ? at[first_double_support] : at[double_support];
        s.single_support = at[single_support];
        s.next_double_support = at[double_support];
        s.next_single_support = at[single_support];
        plan.footholds.col(2) = goes_on ? target : Foothold(plan.footholds.col(0));
    }
    /// The step of the state, and the steps after it.
    Status make(Now at, Plan& plan) const {
        if (const Status good = all_finite(at, command, w_H_left, w_H_right); !good) return good;
        if (!reach(at).is_possible() || at[x][0] > at[x][1] || at[y][0] > at[y][1])
            return Status::failure("x or y goes from a larger to a smaller value; exchange them");
        Step& s = plan.step;
        if (!Step::read(at[now], s)) { // the first step of the block
            s = {0,
                 at[double_support],
                 at[single_support],
                 at[double_support],
                 at[single_support],
                 *first_foot == "left" ? Side::right : Side::left,
                 0,
                 true};
            const bool left = s.stance == Side::left;
            plan.footholds.col(0) = walking::foothold_of(left ? at[w_H_right] : at[w_H_left]);
            plan.footholds.col(1) = walking::foothold_of(left ? at[w_H_left] : at[w_H_right]);
            plan.footholds.col(2) = plan.footholds.col(0);
        } else {
            plan.footholds.leftCols<3>() = at[feet];
        }
        Side side = s.stance;
        Eigen::Index last = 2;
        if (s.ahead > 0) {
            s.ahead = 1;
            for (; s.ahead < *preview; ++s.ahead, ++last) {
                side = walking::other(side);
                Foothold target;
                if (!next_step(at, plan.footholds.col(last - 1), plan.footholds.col(last), side,
                               at[done] + s.ahead + 1, target))
                    break;
                plan.footholds.col(last + 1) = target;
            }
        }
        for (Eigen::Index i = last + 1; i < *preview + 2; ++i)
            plan.footholds.col(i) = plan.footholds.col(last);
        return ok;
    }

    const std::string terrain_;
    mutable walking::Ground ground_;
};

class DcmPlanner final : public StepBlock {
  public:
    using StepBlock::StepBlock;
    Parameter<double> height{
        this,
        "height",
        {.initial = {0.5},
         .above = 0,
         .maximum = largest,
         .unit = unit<"m">,
         .doc = "of the centre of mass above the soles, which gives omega = sqrt(9.81/height)"}};
    Parameter<Eigen::Vector2d> zmp{
        this,
        "zmp",
        {.initial = {0},
         .unit = unit<"m">,
         .doc = "zero-moment point in the axes of the left sole, x y; mirrored for the right one"}};
    Output<Vector3> dcm{this, "dcm", {.unit = unit<"m">, .doc = "wanted c + c_dot/omega in the world"}};
    Output<Vector3> dcm_dot{this, "dcm_dot", {.unit = unit<"m/s">, .doc = "its velocity"}};
    Output<Vector3> vrp{
        this,
        "vrp",
        {.unit = unit<"m">, .doc = "virtual repellent point; `height` below it is the zero-moment point"}};

    Status output(Now at, Out out) const noexcept override {
        Step now;
        if (const Status good = read(at, now); !good) return good;
        const walking::Vrp over{{at[zmp][0], at[zmp][1], at[height]}};
        const auto wanted =
            walking::plan_dcm(at[footholds], now, over, walking::natural_frequency(at[height]));
        out[dcm] = wanted.dcm;
        out[dcm_dot] = wanted.velocity;
        out[vrp] = wanted.vrp;
        return ok;
    }
};

class SwingFoot final : public StepBlock {
  public:
    using StepBlock::StepBlock;
    Parameter<double> apex{this,
                           "apex",
                           {.initial = {0.04},
                            .minimum = 0,
                            .maximum = largest,
                            .unit = unit<"m">,
                            .doc = "height in the middle of the way above its line"}};
    Parameter<double> lift{
        this,
        "lift",
        {.initial = {0},
         .minimum = 0,
         .maximum = 0.5,
         .doc = "part of the single support in which it rises only, as before a step up of the ground"}};
    Parameter<double> sink{this,
                           "sink",
                           {.initial = {0},
                            .minimum = 0,
                            .maximum = 0.4,
                            .doc = "part of the single support, at its end, in which it sinks only, as "
                                   "behind a step down; the planner's "
                                   "freeze should be longer"}};
    Parameter<double> pitch{this,
                            "pitch",
                            {.initial = {0},
                             .minimum = -1,
                             .maximum = 1,
                             .unit = unit<"rad">,
                             .doc = "by which the toes hang most, after 3/8 of the way"}};
    Output<Transform> w_H_left{
        this, "w_H_left", {.unit = mixed_units, .doc = "wanted pose of the left sole"}};
    Output<Vector6> v_left{
        this, "v_left", {.unit = mixed_units, .doc = "its velocity [m/s; rad/s], world axes"}};
    Output<Vector6> a_left{
        this, "a_left", {.unit = mixed_units, .doc = "its acceleration [m/s2; rad/s2], world axes"}};
    Output<Transform> w_H_right{
        this, "w_H_right", {.unit = mixed_units, .doc = "wanted pose of the right sole"}};
    Output<Vector6> v_right{
        this, "v_right", {.unit = mixed_units, .doc = "its velocity [m/s; rad/s], world axes"}};
    Output<Vector6> a_right{
        this, "a_right", {.unit = mixed_units, .doc = "its acceleration [m/s2; rad/s2], world axes"}};
    DiscreteState<Eigen::Matrix3d> along{
        this,
        "along",
        {.unit = mixed_units,
         .doc = "position, velocity and acceleration on the way without the apex, while one foot stands"}};
    DiscreteState<double> phase{this, "phase", {.doc = "part of the way up and down that is over"}};

    Status output(Now at, Out out) const noexcept override {
        Step now;
        if (const Status good = read(at, now); !good) return good;
        walking::SwingState moves, stands;
        stands.pose = walking::pose_of(at[footholds].col(1));
        moves.pose = walking::pose_of(at[footholds].col(0));
        if (!now.on_both_feet()) {
            // The duration of a swing that goes on like this.
            const double x = phase_of(at, now), left = now.duration() - now.time,
                         T = x < 1 && left > 0 ? left / (1 - x) : now.single_support;
            walking::Motion motion = on_the_way(at, now);
            walking::climb(motion, at[footholds](2, 0), at[footholds](2, 2), x * T, T);
            moves = walking::swing(motion, walking::yaw_rotation(at[footholds](3, 0)),
                                   walking::yaw_rotation(at[footholds](3, 2)), at[apex], at[pitch], x * T, T);
        }
        const bool left_stands = now.stance == Side::left;
        const auto &left = left_stands ? stands : moves, &right = left_stands ? moves : stands;
        out[w_H_left] = left.pose;
        out[v_left] = left.velocity;
        out[a_left] = left.acceleration;
        out[w_H_right] = right.pose;
        out[v_right] = right.velocity;
        out[a_right] = right.acceleration;
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        Step now;
        if (const Status good = read(at, now); !good) return good;
        walking::Motion motion{at[footholds].col(0).head<3>(), Vector3::Zero(), Vector3::Zero()};
        if (goes_along(at, now))
            motion = walking::towards(on_the_way(at, now), at[footholds].col(2).head<3>(), time_left(at, now),
                                      at.period());
        next[along].col(0) = motion.position;
        next[along].col(1) = motion.velocity;
        next[along].col(2) = motion.acceleration;
        // What is left of the way takes the time that is left, also where that has changed.
        const double x = phase_of(at, now), left = now.duration() - now.time;
        next[phase] = left > at.period() ? x + (1 - x) * at.period() / left : 1.0;
        return ok;
    }

  private:
    /// Part of the way up and down that is over; it begins with the single support.
    double phase_of(Now at, const Step& now) const {
        const double time = now.time - now.double_support;
        return time > at.period() / 2 ? at[phase] : std::max(time, 0.0) / now.single_support;
    }
    /// Until it is where it sinks; what moves then takes the time until it lands.
    double time_left(Now at, const Step& now) const {
        const double left = now.duration() - now.time, until = left - at[sink] * now.single_support;
        return until > at.period() ? until : left;
    }
    /// Has it been lifted before it goes along?
    bool goes_along(Now at, const Step& now) const {
        const double start = now.double_support + at[lift] * now.single_support;
        return !now.on_both_feet() && now.time > start - at.period() / 2;
    }
    walking::Motion on_the_way(Now at, const Step& now) const {
        const double start = now.double_support + at[lift] * now.single_support;
        // The state does not tell yet of a step that begins.
        if (!goes_along(at, now) || now.time < start + at.period() / 2)
            return {at[footholds].col(0).head<3>(), Vector3::Zero(), Vector3::Zero()};
        return {at[along].col(0), at[along].col(1), at[along].col(2)};
    }
};

class DcmController final : public StepBlock {
  public:
    using StepBlock::StepBlock;
    Input<Vector3> com{this, "com", {.unit = unit<"m">, .doc = "centre of mass in the world"}};
    Input<Vector3> com_dot{this, "com_dot", {.unit = unit<"m/s">, .doc = "its velocity, world axes"}};
    Input<Vector3> dcm_target{this, "dcm_target", {.unit = unit<"m">, .doc = "wanted DCM"}};
    Input<Vector3> dcm_dot_target{this, "dcm_dot_target", {.unit = unit<"m/s">, .doc = "its velocity"}};
    Parameter<double> gain{this,
                           "gain",
                           {.initial = {4},
                            .minimum = 0,
                            .maximum = largest,
                            .unit = unit<"1/s">,
                            .doc = "of the error of the DCM"}};
    Parameter<double> height{this,
                             "height",
                             {.initial = {0.5},
                              .above = 0,
                              .maximum = largest,
                              .unit = unit<"m">,
                              .doc = "of the centre of mass above the soles, as in DcmPlanner"}};
    Parameter<Eigen::Vector2d> x{
        this,
        "x",
        {.initial = {-0.045, 0.098},
         .unit = unit<"m">,
         .doc = "from and to: where the zero-moment point may be, along the x axis of a sole"}};
    Parameter<Eigen::Vector2d> y{
        this,
        "y",
        {.initial = {-0.028, 0.028},
         .unit = unit<"m">,
         .doc = "from and to: where the zero-moment point may be, along the y axis of a sole"}};
    Parameter<double> ankle{
        this,
        "ankle",
        {.initial = {0.7},
         .minimum = 0,
         .maximum = 1,
         .doc =
             "part of the room in the sole that the ankles are trusted with; the foothold takes the rest"}};
    Parameter<double> delay_cost{this,
                                 "delay_cost",
                                 {.initial = {Limits::infinity},
                                  .above = 0,
                                  .unit = unit<"m/s">,
                                  .doc = "shift of the foothold that is as bad as a second by which it is "
                                         "reached earlier or later; infinite: "
                                         "steps keep their time"}};
    Output<Vector3> com_ddot{
        this, "com_ddot", {.unit = unit<"m/s2">, .doc = "wanted acceleration of the centre of mass"}};
    Output<Vector3> vrp{this, "vrp", {.unit = unit<"m">, .doc = "virtual repellent point of that"}};
    Output<Vector3> dcm{this, "dcm", {.unit = unit<"m">, .doc = "c + c_dot/omega"}};
    Output<Eigen::Vector2d> shift{
        this,
        "shift",
        {.unit = unit<"m">, .doc = "how far the next foothold should move, x y in world axes"}};
    Output<double> delay{
        this, "delay", {.unit = unit<"s">, .doc = "how much later the foot that moves should land"}};

    Status output(Now at, Out out) const noexcept override {
        Step now;
        if (const Status good = read(at, now); !good) return good;
        if (const Status good = all_finite(at, com, com_dot, dcm_target, dcm_dot_target); !good) return good;
        if (at[x][0] > at[x][1])
            return Status::failure("x goes from a larger to a smaller value; exchange them");
        if (at[y][0] > at[y][1])
            return Status::failure("y goes from a larger to a smaller value; exchange them");
        const walking::Sole sole{at[x][0], at[x][1], at[y][0], at[y][1]};
        const double omega = walking::natural_frequency(at[height]);
        const walking::DcmReference wanted{at[dcm_target], at[dcm_dot_target],
                                           at[dcm_target] - at[dcm_dot_target] / omega};
        const Vector3 xi = at[com] + at[com_dot] / omega;
        Vector3 r = walking::follow_dcm(xi, wanted, at[gain], omega);
        Eigen::Matrix<double, 2, walking::max_corners> corners;
        const int count = walking::support_corners(at[footholds], now, sole, corners);
        r.head<2>() = walking::nearest_in_hull(corners, count, r.head<2>());

        // The sole that the foothold's shift reckons with is smaller, towards the wanted VRP.
        const Foothold stance = at[footholds].col(1);
        const Eigen::Vector2d local =
            Eigen::Rotation2Dd(-stance[3]) * (wanted.vrp.head<2>() - stance.head<2>());
        const double a = at[ankle];
        const walking::Sole trusted{
            local.x() + a * (sole.x_min - local.x()), local.x() + a * (sole.x_max - local.x()),
            local.y() + a * (sole.y_min - local.y()), local.y() + a * (sole.y_max - local.y())};
        const auto change =
            walking::adjust_step(xi.head<2>(), wanted, stance, now, trusted, omega, at[delay_cost]);
        out[shift] = change.shift;
        out[delay] = change.delay;
        out[vrp] = r;
        out[dcm] = xi;
        out[com_ddot] = omega * omega * (at[com] - r);
        return ok;
    }
};

} // namespace

void add_walking(Library& library) {
    library.group("walking")
        .add<FootstepPlanner>(
            "FootstepPlanner",
            "Where the feet of a biped go, and when: a walk by a velocity, or to a goal, one foothold per "
            "step. "
            "It stands for start_time; "
            "each step is a phase on both feet and one on a single foot. The body, midway between feet "
            "`width` "
            "apart, moves along arcs "
            "of constant velocity (a unicycle where y is 0), and each foothold lands beside it. What is "
            "beyond "
            "the reach of a step is brought "
            "within it, each coordinate by itself: a goal is reached in more steps, a velocity that is too "
            "high "
            "is not reached. A sole that would "
            "stand on an edge of the ground moves along its x axis by the least that avoids that, within "
            "reach; where there is "
            "no such place it stays where it "
            "was wanted. The walk ends after `steps`, at the goal, or at velocity zero, with the feet side "
            "by "
            "side. "
            "`shift` moves the foothold of the foot in the air, within reach as well, but not over an edge; "
            "`delay` lets it land later or, below 0, earlier. "
            "Source: R. Siegwart, I. Nourbakhsh, Introduction to Autonomous Mobile Robots, 2004, ch. 3. "
            "Errors: a ground that is no list of boxes, terrain on which no level sole stands. In a step: a "
            "command, "
            "a pose, a shift or a delay that is not finite.")
        .add<DcmPlanner>("DcmPlanner",
                         "The wanted divergent component of motion (DCM) xi = c + c_dot/omega of a walk, "
                         "omega = sqrt(9.81/height): "
                         "xi_dot = omega (xi - r) with the virtual repellent point r `height` above the "
                         "zero-moment point, "
                         "which stays under each foot that stands "
                         "alone and goes to the next at constant velocity while both stand. It is computed "
                         "backwards from the "
                         "rest after the last planned step, in closed "
                         "form, in each step anew. "
                         "Sources: J. Englsberger, C. Ott, A. Albu-Schäffer, Three-dimensional bipedal "
                         "walking control based "
                         "on divergent component of motion, "
                         "2015; J. Englsberger, G. Mesesan, C. Ott, Smooth trajectory generation and "
                         "push-recovery based on "
                         "divergent component of motion, 2017. "
                         "Errors: in a step, footholds and a step that are not those of a FootstepPlanner.")
        .add<SwingFoot>(
            "SwingFoot",
            "The wanted motion of both soles. The one in the air goes to its foothold on the way "
            "of least jerk, "
            "from the motion that it has, so that the "
            "foothold may move meanwhile; above that 64 x^3 (1-x)^3 apex, x the part of the "
            "single support that "
            "is over; its orientation turns about one axis by "
            "10 x^3 - 15 x^4 + 6 x^5, and its toes hang by pitch x^3 (1-x)^5/((3/8)^3 (5/8)^5). "
            "Of two levels of the ground it is at the higher one in the middle of the single support. "
            "Velocity and acceleration are zero where it lifts off and touches down. "
            "The other one rests. "
            "Source: T. Flash, N. Hogan, The coordination of arm movements, 1985. "
            "Errors: in a step, footholds and a step that are not those of a FootstepPlanner.")
        .add<DcmController>(
            "DcmController",
            "Acceleration of the centre of mass that leads the divergent component of motion xi = c + "
            "c_dot/omega to its target: "
            "r = xi - xi_dot_target/omega + gain/omega (xi - xi_target), com_ddot = omega^2 (c - r), with r "
            "brought into the "
            "hull of the soles that stand. What a push leaves of the error at the end of the single support, "
            "after the zero-moment point has done what it can, goes to `shift` and `delay`: shift = (E - "
            "what the "
            "sole can do) / gamma with E = tau' e + (tau' - tau) (xi_target - r), tau = e^(omega t) for the "
            "time t that is "
            "left, tau' the same with the delay, and gamma = (1 - e^(-omega T))/(omega T) for a double "
            "support T, where "
            "|shift|^2 + (delay_cost/omega (tau'/tau - 1))^2 is least. "
            "Sources: J. Englsberger et al., 2015, as in DcmPlanner; J. Pratt, J. Carff, S. Drakunov, A. "
            "Goswami, "
            "Capture point: a step toward humanoid push recovery, 2006; "
            "M. Khadiv, A. Herzog, S. A. A. Moosavian, L. Righetti, Walking control based on step timing "
            "adaptation, 2020. "
            "Errors: in a step, an input that is not finite, footholds and a step that are not those of a "
            "FootstepPlanner, a rectangle that ends before it begins.");
}

} // namespace bf::toolbox
