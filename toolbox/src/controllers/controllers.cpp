#include "controllers/controllers.hpp"
#include "bf/dynamics/impedance.hpp"
#include "bf/dynamics/lie.hpp"
#include "bf/kernels/pid.hpp"
#include "checks.hpp"
#include "rigid_body/robot_block.hpp"

namespace bf::toolbox {

namespace {

using JacobianMatrix = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using AntiWindup = kernels::AntiWindup;

const std::vector<std::string>& anti_windups() {
    static const std::vector<std::string> all{"back_calculation", "clamping", "none"};
    return all;
}
constexpr const char* anti_windup_doc = "while the output is at a limit: the integral follows it with the "
                                        "tracking time, or stands still (clamping), or grows on";

/// What a kernels::Pid reads and writes: vectors of Eigen in the clothes of the kernels' views.
template <class Pointer> struct View {
    using value_type = double;
    Pointer data;
    int count;
    int size() const { return count; }
    auto& operator[](int i) const { return data[i]; }
};
template <class V> View<const double*> read(const V& v) { return {v.data(), static_cast<int>(v.size())}; }
template <class V> View<double*> written(V&& v) { return {v.data(), static_cast<int>(v.size())}; }

/// One step of a PID controller of the error between r and m, whose output stays within the limits when the
/// feed-forward is added; the filter of the derivative by the backward rule.
struct Pid {
    Vector y, slope_i, slope_d, lower, upper;
    explicit Pid(int size) : y(Vector::Zero(size)), slope_i(y), slope_d(y), lower(y), upper(y) {}

    struct Given {
        const std::string& anti_windup;
        double period;
        Eigen::Ref<const Vector> P, I, D, N, tracking_time, limit, feed_forward, x_i, x_d, r, m;
    };
    /// Leaves y + feed-forward in y.
    void step(const Given& given) noexcept {
        lower = -given.limit - given.feed_forward;
        upper = given.limit - given.feed_forward;
        const auto kind = given.anti_windup == "none"       ? AntiWindup::none
                          : given.anti_windup == "clamping" ? AntiWindup::clamping
                                                            : AntiWindup::back_calculation;
        const Eigen::Vector4d options(static_cast<double>(kind), 0.0, 0.0, 1.0);
        const Eigen::Matrix<double, 1, 1> one(1.0), none(0.0), period(given.period);
        kernels::Pid{}(written(y), written(slope_i), written(slope_d), read(options), read(given.P),
                       read(given.I), read(given.D), read(given.N), read(one), read(one),
                       read(given.tracking_time), read(lower), read(upper), read(period), read(given.x_i),
                       read(given.x_d), read(given.r), read(given.m), read(none));
        y += given.feed_forward;
    }
};

class JointPID final : public RobotBlock {
  public:
    using RobotBlock::RobotBlock;
    Argument<std::string> derivative{this,
                                     "derivative",
                                     {.initial = "measured",
                                      .doc = "measured: D times the error of the velocities s_dot; filtered: "
                                             "of the positions alone, N s/(s + N)",
                                      .choices = {"measured", "filtered"}}};
    Argument<std::string> anti_windup{
        this,
        "anti_windup",
        {.initial = "back_calculation", .doc = anti_windup_doc, .choices = anti_windups()}};
    Input<Vector> s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "joint positions"}};
    Input<Vector> s_dot{this,
                        "s_dot",
                        {.shape = {n},
                         .unit = unit<"rad/s">,
                         .doc = "joint velocities",
                         .present = *derivative == "measured"}};
    Input<Vector> s_target{this, "s_target", {.shape = {n}, .unit = unit<"rad">, .doc = "wanted positions"}};
    Input<Vector> s_dot_target{this,
                               "s_dot_target",
                               {.shape = {n},
                                .unit = unit<"rad/s">,
                                .doc = "wanted velocities; open: zero",
                                .present = *derivative == "measured",
                                .optional = true}};
    Input<Vector> tau_target{this,
                             "tau_target",
                             {.shape = {n},
                              .unit = unit<"Nm">,
                              .doc = "torques that are fed forward, such as those of gravity",
                              .optional = true}};
    Parameter<Vector> P{this,
                        "P",
                        {.shape = {n},
                         .initial = {0},
                         .minimum = 0,
                         .maximum = largest,
                         .unit = unit<"Nm/rad">,
                         .doc = "proportional gain"}};
    Parameter<Vector> I{this,
                        "I",
                        {.shape = {n},
                         .initial = {0},
                         .minimum = 0,
                         .maximum = largest,
                         .unit = any_unit,
                         .doc = "integral gain, Nm/(rad s)"}};
    Parameter<Vector> D{this,
                        "D",
                        {.shape = {n},
                         .initial = {0},
                         .minimum = 0,
                         .maximum = largest,
                         .unit = any_unit,
                         .doc = "derivative gain, Nm s/rad"}};
    Parameter<Vector> N{this,
                        "N",
                        {.shape = {n},
                         .initial = {100},
                         .minimum = 0,
                         .maximum = largest,
                         .unit = unit<"1/s">,
                         .doc = "bandwidth of the derivative filter",
                         .present = *derivative == "filtered"}};
    Parameter<Vector> tracking_time{
        this,
        "tracking_time",
        {.shape = {n}, .initial = {1}, .above = 0, .unit = unit<"s">, .doc = "T_t of back-calculation"}};
    Parameter<Vector> max_torque{this,
                                 "max_torque",
                                 {.shape = {n},
                                  .initial = {bf::Limits::infinity},
                                  .minimum = 0,
                                  .unit = unit<"Nm">,
                                  .doc = "besides the effort limits of the URDF"}};
    Output<Vector> tau{
        this, "tau", {.shape = {n}, .unit = unit<"Nm">, .doc = "joint torques within their limits"}};
    Output<Vector> error{this, "error", {.shape = {n}, .unit = unit<"rad">, .doc = "s_target - s"}};
    DiscreteState<Vector> x_i{this, "x_i", {.shape = {n}, .unit = unit<"Nm">, .doc = "integral part"}};
    DiscreteState<Vector> x_d{this, "x_d", {.shape = {n}, .unit = any_unit, .doc = "filtered D e"}};
    struct Memory {
        Pid pid;
        Vector zero, limit, feed_forward;
    };
    Scratch<Memory> memory{this, [this] {
                               const Vector zero = Vector::Zero(value(n));
                               return Memory{Pid(value(n)), zero, zero, zero};
                           }};

    Status output(Now at, Out out) const noexcept override {
        Status good = all_finite(at, s, s_target, tau_target);
        if (good && s_dot.is_present()) good = all_finite(at, s_dot, s_dot_target);
        if (!good) return good;
        out[tau] = compute(at).y;
        out[error] = at[s_target] - at[s];
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        const Pid& pid = compute(at);
        next[x_i] = at[x_i] + at.period() * pid.slope_i;
        next[x_d] = at[x_d] + at.period() * pid.slope_d;
        return ok;
    }

  private:
    const Pid& compute(Now at) const noexcept {
        auto& w = at[memory];
        w.limit = at[max_torque].cwiseMin(model().effort_max());
        w.feed_forward = at[tau_target];
        if (s_dot.is_present()) w.feed_forward += at[D].cwiseProduct(at[s_dot_target] - at[s_dot]);
        const bool is_filtered = N.is_present();
        w.pid.step({*anti_windup, at.period(), at[P], at[I], is_filtered ? at[D] : view_of(w.zero),
                    is_filtered ? at[N] : view_of(w.zero), at[tracking_time], w.limit, w.feed_forward,
                    at[x_i], at[x_d], at[s_target], at[s]});
        return w.pid;
    }
    static Eigen::Map<const Vector> view_of(const Vector& v) { return {v.data(), v.size()}; }
};

class CartesianPID final : public Block {
  public:
    using Block::Block;
    Argument<std::string> result{
        this,
        "result",
        {.initial = "acceleration",
         .doc = "acceleration: a = a_target + D (v_target - v) + P e + I int e, as a CartesianTask or an "
                "acceleration interface takes it; velocity: v = v_target + P e + I int e",
         .choices = {"acceleration", "velocity"}}};
    Argument<std::string> anti_windup{
        this,
        "anti_windup",
        {.initial = "back_calculation", .doc = anti_windup_doc, .choices = anti_windups()}};
    Input<Transform> w_H_f{this, "w_H_f", {.unit = mixed_units, .doc = "pose of the frame in the world"}};
    Input<Transform> w_H_target{this, "w_H_target", {.unit = mixed_units, .doc = "wanted pose in the world"}};
    Input<Vector6> v{this,
                     "v",
                     {.unit = mixed_units,
                      .doc = "velocity of the frame, mixed: origin [m/s], angular [rad/s], world axes",
                      .present = gives_acceleration()}};
    Input<Vector6> v_target{
        this,
        "v_target",
        {.unit = mixed_units, .doc = "wanted velocity, mixed; open: zero", .optional = true}};
    Input<Vector6> a_target{this,
                            "a_target",
                            {.unit = mixed_units,
                             .doc = "acceleration that is fed forward, mixed; open: zero",
                             .present = gives_acceleration(),
                             .optional = true}};
    Parameter<Vector6> P{this,
                         "P",
                         {.initial = {10},
                          .minimum = 0,
                          .maximum = largest,
                          .unit = any_unit,
                          .doc = "of the error: 1/s2, or 1/s of a velocity"}};
    Parameter<Vector6> I{this,
                         "I",
                         {.initial = {0},
                          .minimum = 0,
                          .maximum = largest,
                          .unit = any_unit,
                          .doc = "of its integral: 1/s3, or 1/s2"}};
    Parameter<Vector6> D{this,
                         "D",
                         {.initial = {6},
                          .minimum = 0,
                          .maximum = largest,
                          .unit = unit<"1/s">,
                          .doc = "of the error of the velocity",
                          .present = gives_acceleration()}};
    Parameter<Vector6> tracking_time{
        this,
        "tracking_time",
        {.initial = {1}, .above = 0, .unit = unit<"s">, .doc = "T_t of back-calculation"}};
    Parameter<Vector6> limit{this,
                             "limit",
                             {.initial = {bf::Limits::infinity},
                              .minimum = 0,
                              .unit = any_unit,
                              .doc = "largest magnitude of each element of the command"}};
    Output<Vector6> command{
        this,
        "command",
        {.unit = mixed_units,
         .doc = "acceleration [m/s2; rad/s2] or velocity [m/s; rad/s] of the frame, mixed, world axes"}};
    Output<Vector6> error{
        this,
        "error",
        {.unit = mixed_units, .doc = "position [m], rotation vector of R_target R' [rad], world axes"}};
    DiscreteState<Vector6> x_i{this, "x_i", {.unit = mixed_units, .doc = "integral part"}};
    Scratch<Pid> memory{this, [] { return Pid(6); }};

    Status output(Now at, Out out) const noexcept override {
        Status good = all_finite(at, w_H_f, w_H_target, v_target);
        if (good && v.is_present()) good = all_finite(at, v, a_target);
        if (good) good = is_rotation(at, w_H_f);
        if (good) good = is_rotation(at, w_H_target);
        if (!good) return good;
        Vector6 e;
        out[command] = compute(at, e).y;
        out[error] = e;
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        Vector6 e;
        next[x_i] = at[x_i] + at.period() * compute(at, e).slope_i;
        return ok;
    }

  private:
    bool gives_acceleration() const { return *result == "acceleration"; }
    const Pid& compute(Now at, Vector6& e) const noexcept {
        e = dynamics::pose_error(at[w_H_f], at[w_H_target]);
        Vector6 feed_forward = at[v_target];
        if (gives_acceleration()) feed_forward = at[a_target] + at[D].cwiseProduct(at[v_target] - at[v]);
        const Vector6 zero = Vector6::Zero();
        auto& pid = at[memory];
        pid.step({*anti_windup, at.period(), at[P], at[I], zero, zero, at[tracking_time], at[limit],
                  feed_forward, at[x_i], zero, e, zero});
        return pid;
    }
};

constexpr const char* compensation_doc =
    "torques beside those of the impedance: dynamics: all that the motion needs, M nu_dot + h for the "
    "target's acceleration; gravity: g; none";

class JointImpedance final : public VelocityBlock {
  public:
    using VelocityBlock::VelocityBlock;
    Argument<std::string> compensation{
        this,
        "compensation",
        {.initial = "dynamics", .doc = compensation_doc, .choices = {"dynamics", "gravity", "none"}}};
    Input<Vector> s_target{this, "s_target", {.shape = {n}, .unit = unit<"rad">, .doc = "wanted positions"}};
    Input<Vector> s_dot_target{
        this,
        "s_dot_target",
        {.shape = {n}, .unit = unit<"rad/s">, .doc = "wanted velocities; open: zero", .optional = true}};
    Input<Vector> s_ddot_target{this,
                                "s_ddot_target",
                                {.shape = {n},
                                 .unit = unit<"rad/s2">,
                                 .doc = "wanted accelerations; open: zero",
                                 .present = *compensation == "dynamics",
                                 .optional = true}};
    Parameter<Vector> stiffness{this,
                                "stiffness",
                                {.shape = {n},
                                 .initial = {10},
                                 .minimum = 0,
                                 .maximum = largest,
                                 .unit = unit<"Nm/rad">,
                                 .doc = "K of each joint"}};
    Parameter<Vector> damping{this,
                              "damping",
                              {.shape = {n},
                               .initial = {1},
                               .minimum = 0,
                               .maximum = largest,
                               .unit = any_unit,
                               .doc = "D of each joint, Nm s/rad"}};
    Output<Vector> tau{this, "tau", {.shape = {n}, .unit = unit<"Nm">, .doc = "joint torques"}};
    Output<Vector> error{this, "error", {.shape = {n}, .unit = unit<"rad">, .doc = "s_target - s"}};
    Scratch<Vector> forces{this, [this] { return Vector(value(v)); }};

    Status evaluate(Now at, Out out) const noexcept override {
        Status good = all_finite(at, s_target, s_dot_target);
        if (good && s_ddot_target.is_present()) good = all_finite(at, s_ddot_target);
        if (!good) return good;
        auto& of_model = at[forces];
        of_model.setZero();
        if (*compensation == "dynamics")
            dynamics::inverse_dynamics(model(), at_state(at), Vector6::Zero(), at[s_ddot_target], of_model);
        else if (*compensation == "gravity")
            dynamics::gravity_forces(model(), PositionBlock::at_state(at), of_model);
        out[error] = at[s_target] - at[s];
        out[tau] = at[stiffness].cwiseProduct(at[s_target] - at[s]) +
                   at[damping].cwiseProduct(at[s_dot_target] - at[s_dot]) + of_model.tail(at[s].size());
        return ok;
    }
};

class CartesianImpedance final : public VelocityBlock {
  public:
    using VelocityBlock::VelocityBlock;
    FrameArgument frame{this, "frame", "name of a link or frame"};
    Argument<std::string> axes{this,
                               "axes",
                               {.initial = "world",
                                .doc = "of stiffness and damping: the world's, or the target's",
                                .choices = {"world", "target"}}};
    Argument<std::string> compensation{
        this,
        "compensation",
        {.initial = "dynamics",
         .doc = "torques beside those of the impedance: dynamics: h, Coriolis and gravity; gravity: g; none",
         .choices = {"dynamics", "gravity", "none"}}};
    Argument<bool> posture{this,
                           "posture",
                           {.initial = false,
                            .doc = "joints have an impedance, too, as far as it does not accelerate the "
                                   "frame; needs a fixed base"}};
    Input<Transform> w_H_target{this, "w_H_target", {.unit = mixed_units, .doc = "wanted pose in the world"}};
    Input<Vector6> v_target{
        this,
        "v_target",
        {.unit = mixed_units, .doc = "wanted velocity, mixed; open: zero", .optional = true}};
    Input<Vector6> f_target{
        this,
        "f_target",
        {.unit = mixed_units,
         .doc = "wrench that is fed forward [N; Nm], at the frame's origin, world axes; open: zero",
         .optional = true}};
    Input<Vector> s_target{
        this, "s_target", {.shape = {n}, .unit = unit<"rad">, .doc = "posture", .present = posture}};
    Parameter<Vector6> stiffness{this,
                                 "stiffness",
                                 {.initial = {100, 100, 100, 10, 10, 10},
                                  .minimum = 0,
                                  .maximum = largest,
                                  .unit = mixed_units,
                                  .doc = "K of the error [N/m; Nm/rad]"}};
    Parameter<Vector6> damping{this,
                               "damping",
                               {.initial = {20, 20, 20, 1, 1, 1},
                                .minimum = 0,
                                .maximum = largest,
                                .unit = mixed_units,
                                .doc = "D of the error of the velocity [N s/m; Nm s/rad]"}};
    Parameter<Vector> posture_stiffness{this,
                                        "posture_stiffness",
                                        {.shape = {n},
                                         .initial = {5},
                                         .minimum = 0,
                                         .maximum = largest,
                                         .unit = unit<"Nm/rad">,
                                         .doc = "of the joints",
                                         .present = posture}};
    Parameter<Vector> posture_damping{this,
                                      "posture_damping",
                                      {.shape = {n},
                                       .initial = {1},
                                       .minimum = 0,
                                       .maximum = largest,
                                       .unit = any_unit,
                                       .doc = "of the joints, Nm s/rad",
                                       .present = posture}};
    Output<Vector> tau{this, "tau", {.shape = {n}, .unit = unit<"Nm">, .doc = "joint torques"}};
    Output<Vector6> f{
        this, "f", {.unit = mixed_units, .doc = "wrench of the impedance on the frame [N; Nm], world axes"}};
    Output<Vector6> error{
        this,
        "error",
        {.unit = mixed_units, .doc = "position [m], rotation vector of R_target R' [rad], world axes"}};
    struct Memory {
        Vector forces, of_posture;
        dynamics::NullSpace null_space;
    };
    Scratch<Memory> memory{this, [this] {
                               const Vector zero = Vector::Zero(value(v));
                               return Memory{zero, zero, dynamics::NullSpace(value(v))};
                           }};

    void infer(Inference& inference) const override {
        frame.resolve(robot);
        if (posture && robot.is_bound() && model().has_floating_base())
            inference.refuse(
                "posture is true, but the robot's base floats and takes part in its null space; use "
                "TaskSpaceInverseDynamics, or let the Configuration have floating_base: false");
    }
    Status evaluate(Now at, Out out) const noexcept override {
        Status good = all_finite(at, w_H_target, v_target, f_target);
        if (good && s_target.is_present()) good = all_finite(at, s_target);
        if (good) good = is_rotation(at, w_H_target);
        if (!good) return good;
        auto& w = at[memory];
        auto& data = at_state(at);
        w.forces.setZero();
        if (*compensation == "dynamics") dynamics::bias_forces(model(), data, w.forces);
        if (*compensation == "gravity") dynamics::gravity_forces(model(), data, w.forces);
        Vector6 wrench, e;
        dynamics::cartesian_impedance(model(), data, frame.frame, at[w_H_target], at[v_target],
                                      {at[stiffness], at[damping], *axes == "target"}, wrench, e);
        wrench += at[f_target];
        dynamics::add_wrench(model(), data, frame.frame, wrench, w.forces);
        if (posture) {
            w.of_posture = at[posture_stiffness].cwiseProduct(at[s_target] - at[s]) -
                           at[posture_damping].cwiseProduct(at[s_dot]);
            w.null_space.project(model(), data, frame.frame, w.of_posture);
            w.forces += w.of_posture;
        }
        out[tau] = w.forces.tail(at[s].size());
        out[f] = wrench;
        out[error] = e;
        return ok;
    }
};

} // namespace

void add_controllers(Library& library) {
    library.group("controllers")
        .add<JointPID>("JointPID",
                       "Torques of joints that follow positions: tau = tau_target + P e + I int e + D e_dot "
                       "with e = s_target - s, within the effort limits of the URDF and max_torque. e_dot is "
                       "that of the measured velocities or the filtered one of the positions, N s/(s + N) by "
                       "the backward rule. While a torque is at its limit, feed-forward included, the "
                       "integral is kept from winding up. Source: K. J. Åström, T. Hägglund, Advanced PID "
                       "Control, 2006, §3.5. Errors: in a step, an input that is not finite.")
        .add<CartesianPID>(
            "CartesianPID",
            "Acceleration or velocity by which a frame follows a pose: a = a_target + D (v_target - v) + P e "
            "+ I int e, or v = v_target + P e + I int e, with e = p_target - p and the rotation vector of "
            "R_target R', all in world axes, within limits; the integral is kept from winding up. Source: B. "
            "Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics: Modelling, Planning and Control, "
            "2009, §3.7. Errors: in a step, an input that is not finite, or a pose whose rotation is none.")
        .add<JointImpedance>(
            "JointImpedance",
            "Torques by which joints behave like springs and dampers: tau = K (s_target - s) + D "
            "(s_dot_target - s_dot) + M s_ddot_target + h, h the joints' part of the bias forces; of a "
            "floating base, which has no torque, the acceleration is taken as zero. Source: N. Hogan, "
            "Impedance control: an approach to manipulation, 1985. Errors: in a step, an input that is not "
            "finite, or a w_H_b whose rotation is none.")
        .add<CartesianImpedance>(
            "CartesianImpedance",
            "Torques by which a frame behaves like a spring and damper: tau = J' f + h with the wrench f = K "
            "e + D (v_target - J nu) + f_target, e = p_target - p and the rotation vector of R_target R'. "
            "With posture the joints have an impedance of their own in the dynamically consistent null "
            "space, tau_0 - J' (J M^-1 J')^-1 J M^-1 tau_0, which does not accelerate the frame. Sources: N. "
            "Hogan, Impedance control: an approach to manipulation, 1985; O. Khatib, A unified approach for "
            "motion and force control of robot manipulators, 1987. Errors: a frame that the robot does not "
            "have (the text lists similar ones), posture of a floating base. In a step: an input that is not "
            "finite, or a pose whose rotation is none.");
}

} // namespace bf::toolbox
