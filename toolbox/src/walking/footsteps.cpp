#include "walking/step.hpp"
#include "walking/walking.hpp"
#include "world/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bf::toolbox {

namespace {

constexpr int max_preview = 16;

class FootstepPlanner final : public Block {
  public:
    using Block::Block;
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
                                          .at_least = min_single_support.index(),
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
    Output<bool> blocked{
        this, "blocked", {.doc = "the walk stands, and no step leads on to where the command goes"}};
    DiscreteState<Eigen::Matrix<double, 4, 3>> feet{
        this, "feet", {.unit = mixed_units, .doc = "the first three footholds"}};
    DiscreteState<Vector> now{this, "now", {.shape = {numbers}, .unit = mixed_units, .doc = "the step"}};
    DiscreteState<double> done{this, "done", {.doc = "feet that have landed"}};

    void infer(Inference& inference) const override {
        try {
            Matrix boxes = *ground;
            if (!terrain->empty()) {
                const Matrix more = read_boxes(path_of(*terrain));
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
        out[blocked] = is_blocked(at, plan);
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
    /// Where the command wants the foot beside `stance` in step `number` (from 1). False: the walk has no
    /// such step.
    bool wish(Now at, const Foothold& stance, Side side, double number, Foothold& wanted) const {
        if (number > at[steps]) return false;
        Vector3 motion = Vector3::Zero();
        if (number + 1 <= at[steps]) {
            motion = *follow == "goal" ? walking::motion_to(at[command], stance, side, at[width])
                                       : Vector3(at[command] * (at[double_support] + at[single_support]));
            // Half a turn and more is the most in that direction, not less in the other one.
            constexpr double most = 0.99 * std::numbers::pi;
            motion[2] = std::clamp(motion[2], -most, most);
        }
        wanted = walking::next_foothold(stance, side, at[width], motion);
        return true;
    }
    /// Farther than so many of the largest distances?
    static bool is_away(const Foothold& there, const Foothold& here, double tolerance) {
        return (there - here).head<2>().norm() > tolerance * near_m ||
               std::abs(walking::wrapped(there[3] - here[3])) > tolerance * near_rad;
    }
    /// Where the foot at `moving` goes in that step. False: it is there.
    bool next_step(Now at, const Foothold& moving, const Foothold& stance, Side side, double number,
                   Foothold& target, double tolerance = 1) const {
        Foothold wanted;
        if (!wish(at, stance, side, number, wanted)) return false;
        target = placed(at, wanted, stance, side);
        return is_away(target, moving, tolerance);
    }
    /// Do the feet stand where neither has a step, though the command wants one of them elsewhere?
    bool is_blocked(Now at, const Plan& plan) const {
        if (plan.step.ahead > 0) return false;
        const auto wants = [&](const auto& moving, const auto& stance, Side side) {
            Foothold target;
            return wish(at, stance, side, at[done] + 1, target) && is_away(target, moving, 2);
        };
        const auto first = plan.footholds.col(0), second = plan.footholds.col(1);
        if (!wants(first, second, plan.step.stance) &&
            !wants(second, first, walking::other(plan.step.stance)))
            return false;
        Plan next = plan;
        begin(at, next, at[done], true);
        return next.step.ahead == 0;
    }
    /// The first step from where the feet of the plan stand, or none.
    void begin(Now at, Plan& plan, double landed, bool from_rest) const {
        Step& s = plan.step;
        Foothold target;
        auto lifted = plan.footholds.col(0), stance = plan.footholds.col(1);
        bool goes_on = next_step(at, lifted, stance, s.stance, landed + 1, target);
        if (!goes_on && from_rest) {
            // It may be the other foot that has some way to go, as the one that landed last after a push.
            // Where it lands is known less well than where it should.
            const Side other = walking::other(s.stance);
            if (!next_step(at, stance, lifted, other, landed + 1, target, 2)) return; // and waits
            lifted.swap(stance);
            s.stance = other;
            goes_on = true;
        }
        s.time = 0;
        s.from_rest = from_rest;
        s.ahead = goes_on ? 1 : 0;
        s.double_support = from_rest ? at[first_double_support] : at[double_support];
        s.single_support = at[single_support];
        s.next_double_support = at[double_support];
        s.next_single_support = at[single_support];
        plan.footholds.col(2) = goes_on ? target : Foothold(plan.footholds.col(0));
    }
    /// Do the soles lie, and the left one at the left of the right one?
    Status check_start(Now at) const {
        const Eigen::Matrix4d left = at[w_H_left], right = at[w_H_right];
        for (const auto& [key, pose] : {std::pair{&w_H_left, &left}, {&w_H_right, &right}})
            if ((*pose)(2, 2) < 0.5)
                return Status::failure("{element} is no sole that stands: its z axis is more than 60 degrees "
                                       "from upright; give the frame of a sole with z up",
                                       *key, -1);
        if ((right.topLeftCorner<3, 3>().transpose() * (left - right).topRightCorner<3, 1>()).y() > 0)
            return ok;
        return Status::failure("{element} is not at the left of w_H_right, along the y axis of that one; "
                               "exchange the feet, or let their frames have x forwards and z up",
                               w_H_left, -1);
    }
    /// The step of the state, and the steps after it.
    Status make(Now at, Plan& plan) const {
        if (const Status good = all_finite(at, command, w_H_left, w_H_right); !good) return good;
        if (const Status good = is_rotation(at, w_H_left); !good) return good;
        if (const Status good = is_rotation(at, w_H_right); !good) return good;
        if (at[steps] != std::floor(at[steps]))
            return Status::failure("steps is no whole number; give one, or Inf");
        if (at[width] < at[min_width] || at[width] > at[max_width])
            return Status::failure(
                "width is not from min_width to max_width; let the feet stand as far apart as they may step");
        if (at[x][0] > at[x][1])
            return Status::failure("x goes from a larger to a smaller value; exchange them");
        if (at[y][0] > at[y][1])
            return Status::failure("y goes from a larger to a smaller value; exchange them");
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
            if (const Status good = check_start(at); !good) return good;
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

    mutable walking::Ground ground_;
};

} // namespace

void add_footsteps(Library& library) {
    library.group("walking").add<FootstepPlanner>(
        "FootstepPlanner",
        "Where the feet of a biped go, and when: a walk by a velocity, or to a goal, one foothold per step. "
        "It stands for start_time; each step is a phase on both feet and one on a single foot. The body, "
        "midway between feet `width` apart, moves along arcs of constant velocity (a unicycle where y is 0), "
        "and each foothold lands beside it. What is beyond the reach of a step is brought within it, each "
        "coordinate by itself: a goal is reached in more steps, a velocity that is too high is not reached. "
        "A sole that would stand on an edge of the ground moves along its x axis by the least that avoids "
        "that, within reach; where there is no such place it stays where it was wanted. The walk ends after "
        "`steps`, at the goal, or at velocity zero, with the feet side by side, and goes on with either foot "
        "where one is then more than 2 cm or 0.1 rad away; where no step leads there, over an edge or to a "
        "goal out of reach, it stands and says so in `blocked`. `shift` moves the foothold of the foot in "
        "the air, within reach as well, but not over an edge; `delay` lets it land later or, below 0, "
        "earlier. Source: R. Siegwart, I. Nourbakhsh, Introduction to Autonomous Mobile Robots, 2004, ch. 3. "
        "Errors: a ground that is no list of boxes, terrain on which no level sole stands. In a step: a "
        "command, a pose, a shift or a delay that is not finite.");
}

} // namespace bf::toolbox
