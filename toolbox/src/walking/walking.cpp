#include "walking/walking.hpp"
#include "bf/walking/swing.hpp"
#include "walking/step.hpp"

#include <algorithm>
#include <cmath>

namespace bf::toolbox {

namespace {

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
                                   "behind a step down; the planner's freeze should be longer"}};
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
                                         "reached earlier or later; infinite: steps keep their time"}};
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
    add_footsteps(library);
    library.group("walking")
        .add<DcmPlanner>(
            "DcmPlanner",
            "The wanted divergent component of motion (DCM) xi = c + c_dot/omega of a walk, omega = "
            "sqrt(9.81/height): xi_dot = omega (xi - r) with the virtual repellent point r `height` above "
            "the zero-moment point, which stays under each foot that stands alone and goes to the next at "
            "constant velocity while both stand. It is computed backwards from the rest after the last "
            "planned step, in closed form, in each step anew. Sources: J. Englsberger, C. Ott, A. "
            "Albu-Schäffer, Three-dimensional bipedal walking control based on divergent component of "
            "motion, 2015; J. Englsberger, G. Mesesan, C. Ott, Smooth trajectory generation and "
            "push-recovery based on divergent component of motion, 2017. Errors: in a step, footholds and a "
            "step that are not those of a FootstepPlanner.")
        .add<SwingFoot>(
            "SwingFoot",
            "The wanted motion of both soles. The one in the air goes to its foothold on the way of least "
            "jerk, from the motion that it has, so that the foothold may move meanwhile; above that 64 x^3 "
            "(1-x)^3 apex, x the part of the single support that is over; its orientation turns about one "
            "axis by 10 x^3 - 15 x^4 + 6 x^5, and its toes hang by pitch x^3 (1-x)^5/((3/8)^3 (5/8)^5). Of "
            "two levels of the ground it is at the higher one in the middle of the single support. Velocity "
            "and acceleration are zero where it lifts off and touches down. The other one rests. Source: T. "
            "Flash, N. Hogan, The coordination of arm movements, 1985. Errors: in a step, footholds and a "
            "step that are not those of a FootstepPlanner.")
        .add<DcmController>(
            "DcmController",
            "Acceleration of the centre of mass that leads the divergent component of motion xi = c + "
            "c_dot/omega to its target: r = xi - xi_dot_target/omega + gain/omega (xi - xi_target), com_ddot "
            "= omega^2 (c - r), with r brought into the hull of the soles that stand. What a push leaves of "
            "the error at the end of the single support, after the zero-moment point has done what it can, "
            "goes to `shift` and `delay`: shift = (E - what the sole can do) / gamma with E = tau' e + (tau' "
            "- tau) (xi_target - r), tau = e^(omega t) for the time t that is left, tau' the same with the "
            "delay, and gamma = (1 - e^(-omega T))/(omega T) for a double support T, where |shift|^2 + "
            "(delay_cost/omega (tau'/tau - 1))^2 is least. Sources: J. Englsberger et al., 2015, as in "
            "DcmPlanner; J. Pratt, J. Carff, S. Drakunov, A. Goswami, Capture point: a step toward humanoid "
            "push recovery, 2006; M. Khadiv, A. Herzog, S. A. A. Moosavian, L. Righetti, Walking control "
            "based on step timing adaptation, 2020. Errors: in a step, an input that is not finite, "
            "footholds and a step that are not those of a FootstepPlanner, a rectangle that ends before it "
            "begins.");
}

} // namespace bf::toolbox
