#include "estimators/estimators.hpp"
#include "bf/dynamics/contact_ekf.hpp"
#include "bf/dynamics/estimation.hpp"
#include "bf/dynamics/lie.hpp"
#include "checks.hpp"
#include "rigid_body/robot_block.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace bf::toolbox {

namespace {

using JacobianMatrix = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Names = Argument<std::vector<std::string>>;
constexpr const char* contacts_doc = "of each frame: above 0.5 it stands";

void find_frames(const dynamics::Model& model, const std::vector<std::string>& names,
                 std::vector<dynamics::Frame>& frames) {
    frames.clear();
    for (const std::string& name : names) frames.push_back(model.frame(name));
}

/// Does not let a frame be named twice, whose measurement would count twice.
void refuse_twice(const Inference& inference, const char* argument, const std::vector<std::string>& names) {
    for (auto name = names.begin(); name != names.end(); ++name)
        if (std::find(names.begin(), name, *name) != name)
            inference.refuse(std::string(argument) + " names '" + *name + "' twice; name it once");
}

/// Number of the frame in contact with the largest value, from 0; -1: there is none.
template <class Contacts> int strongest(const Contacts& contacts) {
    Eigen::Index best = 0;
    return contacts.maxCoeff(&best) > 0.5 ? static_cast<int>(best) : -1;
}

void refuse_fixed_base(const Inference& inference, const dynamics::Model& model) {
    if (!model.has_floating_base())
        inference.refuse("the robot's base is fixed and needs no estimate; leave the block out, or let the "
                         "Configuration have floating_base: true");
}

class MomentumObserver final : public VelocityBlock {
  public:
    using VelocityBlock::VelocityBlock;
    Names frames{this, "frames", {.doc = "frames on which the unknown wrenches act, ports f_NAME"}};
    Names known{this, "known", {.doc = "frames whose wrenches are measured, ports known_NAME"}};
    Input<Vector> tau{
        this, "tau", {.shape = {n}, .unit = unit<"Nm">, .doc = "joint torques of the last interval"}};
    InputList<Vector6> of_known{
        this,
        prefixed("known_", *known),
        {.unit = mixed_units,
         .doc = "wrench of the last interval at the frame's origin [N; Nm], world axes"}};
    Parameter<double> gain{this,
                           "gain",
                           {.initial = {50},
                            .above = 0,
                            .maximum = largest,
                            .unit = unit<"1/s">,
                            .doc = "K, bandwidth of the observer"}};
    Parameter<double> damping{this,
                              "damping",
                              {.initial = {1e-3},
                               .minimum = 0,
                               .maximum = largest,
                               .doc = "of wrenches that joints hardly feel",
                               .present = !frames->empty()}};
    Output<Vector> r{this,
                     "r",
                     {.shape = {v},
                      .unit = mixed_units,
                      .doc = "generalised forces that the model does not explain, filtered: sum J' f"}};
    OutputList<Vector6> f{this,
                          prefixed("f_", *frames),
                          {.unit = mixed_units, .doc = "wrench at the frame's origin [N; Nm], world axes"}};
    DiscreteState<Vector> last_r{this, "last_r", {.shape = {v}, .unit = mixed_units, .doc = "r before"}};
    DiscreteState<Vector> last_p{
        this, "last_p", {.shape = {v}, .unit = mixed_units, .doc = "momentum of the step before"}};
    DiscreteState<Vector> last_beta{
        this,
        "last_beta",
        {.shape = {v}, .unit = mixed_units, .doc = "its rate without torques and wrenches"}};
    DiscreteState<bool> goes_on{this, "goes_on", {.doc = "there is a step before"}};
    struct Memory {
        dynamics::WrenchesOfForces wrenches;
        Matrix M;
        Vector nu, p, beta, r, f;
    };
    Scratch<Memory> memory{this, [this] {
                               const Vector zero = Vector::Zero(value(v));
                               return Memory{dynamics::WrenchesOfForces(model(), frames_),
                                             Matrix(value(v), value(v)),
                                             zero,
                                             zero,
                                             zero,
                                             zero,
                                             Vector::Zero(6 * static_cast<Eigen::Index>(frames_.size()))};
                           }};

    void infer(Inference& inference) const override {
        if (!robot.is_bound()) return;
        find_frames(model(), *frames, frames_);
        find_frames(model(), *known, known_);
        auto all = *frames;
        all.insert(all.end(), known->begin(), known->end());
        refuse_twice(inference, "arguments 'frames' and 'known' together", all);
    }
    Status evaluate(Now at, Out out) const noexcept override {
        if (!(at.period() > 0)) return Status::failure("a continuous block has no period; give it one");
        Status good = all_finite(at, tau);
        for (const auto& key : of_known)
            if (good) good = all_finite(at, key);
        if (!good) return good;
        Memory& w = at[memory];
        compute(at, w);
        out[r] = w.r;
        if (f.size() > 0) w.wrenches.find(model(), data(at), w.r, at[damping], w.f);
        for (int i = 0; i < f.size(); ++i) out[f[i]] = w.f.segment<6>(6 * i);
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        Memory& w = at[memory];
        compute(at, w);
        next[last_r] = w.r;
        next[last_p] = w.p;
        next[last_beta] = w.beta;
        next[goes_on] = true;
        return ok;
    }

  private:
    /// r follows the mean force of the interval, (p - p⁻)/T - β - tau, as a first-order filter that is exact
    /// for a constant one.
    void compute(Now at, Memory& w) const noexcept {
        auto& of_robot = at_state(at);
        const Vector6 base = model().has_floating_base() ? Vector6(at[v_b]) : Vector6(Vector6::Zero());
        dynamics::momentum_balance(model(), of_robot, base, at[s_dot], w.p, w.beta, w.M, w.nu);
        w.r.setZero();
        if (!at[goes_on]) return;
        for (std::size_t i = 0; i < known_.size(); ++i)
            dynamics::add_wrench(model(), of_robot, known_[i], at[of_known[static_cast<int>(i)]], w.r);
        w.r.tail(at[tau].size()) += at[tau];
        w.r = (w.p - at[last_p]) / at.period() - 0.5 * (w.beta + at[last_beta]) - w.r;
        const double rest = std::exp(-at[gain] * at.period());
        w.r = rest * at[last_r] + (1.0 - rest) * w.r;
    }

    mutable std::vector<dynamics::Frame> frames_, known_;
};

class ContactWrenches final : public VelocityBlock {
  public:
    using VelocityBlock::VelocityBlock;
    Names sensors{this, "sensors", {.doc = "fixed joints with force/torque sensors, ports ft_NAME"}};
    Names contacts{this, "contacts", {.doc = "frames that something touches, ports f_NAME"}};
    Input<Vector> nu_dot{this,
                         "nu_dot",
                         {.shape = {v},
                          .unit = mixed_units,
                          .doc = "acceleration, mixed; open: zero, for slow motions",
                          .optional = true}};
    InputList<Vector6> ft{this,
                          prefixed("ft_", *sensors),
                          {.unit = mixed_units,
                           .doc = "what the child link exerts on its parent [N; Nm], at its origin and in "
                                  "its axes, as GetSensor tells"}};
    OutputList<Vector6> f{
        this,
        prefixed("f_", *contacts),
        {.unit = mixed_units, .doc = "wrench on the frame at its origin [N; Nm], world axes"}};
    Output<Vector> tau{this, "tau", {.shape = {n}, .unit = unit<"Nm">, .doc = "joint torques"}};
    struct Memory {
        dynamics::ContactWrenches estimator;
        JacobianMatrix measured, wrenches;
    };
    Scratch<Memory> memory{this, [this] {
                               return Memory{
                                   dynamics::ContactWrenches(model(), robot->urdf, *sensors, *contacts),
                                   JacobianMatrix::Zero(6, ft.size()), JacobianMatrix::Zero(6, f.size())};
                           }};

    void infer(Inference& inference) const override {
        if (!robot.is_bound()) return;
        try {
            dynamics::ContactWrenches(model(), robot->urdf, *sensors, *contacts);
        } catch (const std::exception& wrong) {
            inference.refuse(wrong.what());
        }
    }
    Status evaluate(Now at, Out out) const noexcept override {
        Status good = all_finite(at, nu_dot);
        for (const auto& key : ft)
            if (good) good = all_finite(at, key);
        if (!good) return good;
        Memory& w = at[memory];
        for (int i = 0; i < ft.size(); ++i) w.measured.col(i) = at[ft[i]];
        w.estimator.find(model(), at_state(at), at[s], at[s_dot], at[nu_dot], w.measured, w.wrenches,
                         out[tau]);
        for (int i = 0; i < f.size(); ++i) out[f[i]] = w.wrenches.col(i);
        return ok;
    }
};

class LegOdometry final : public RobotBlock {
  public:
    using RobotBlock::RobotBlock;
    Names frames{
        this, "frames", {.initial = {"l_sole", "r_sole"}, .doc = "frames that stand, such as soles"}};
    Argument<std::string> imu{
        this, "imu", {.doc = "frame whose orientation is measured, port w_R_imu; none: legs alone"}};
    Dim k{this, "k", [this]() -> Dim::Names { return *frames; }};
    Input<Vector> s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "joint positions"}};
    Input<Vector> s_dot{this, "s_dot", {.shape = {n}, .unit = unit<"rad/s">, .doc = "joint velocities"}};
    Input<Vector> contacts{this, "contacts", {.shape = {k}, .unit = any_unit, .doc = contacts_doc}};
    Input<Eigen::Matrix3d> w_R_imu{
        this, "w_R_imu", {.doc = "orientation, axes of the frame in the world", .present = !imu->empty()}};
    Input<Vector3> gyroscope{this,
                             "gyroscope",
                             {.unit = unit<"rad/s">,
                              .doc = "angular velocity, axes of the imu; open: the rate of w_R_imu over the "
                                     "last period, zero at first",
                              .present = !imu->empty(),
                              .optional = true}};
    Input<Transform> w_H_b_0{
        this,
        "w_H_b_0",
        {.initial = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
         .unit = mixed_units,
         .doc = "base pose of the first step; open: that of which the frame that stands is at the origin",
         .optional = true}};
    Output<Transform> w_H_b{this, "w_H_b", {.unit = mixed_units, .doc = base_pose_doc}};
    Output<Vector6> v_b{this, "v_b", {.unit = mixed_units, .doc = base_velocity_doc}};
    Output<double> stance{this, "stance", {.doc = "number of the frame that holds the robot, from 1"}};
    DiscreteState<Transform> w_H_stance{
        this, "w_H_stance", {.unit = mixed_units, .doc = "pose of the frame that holds the robot"}};
    DiscreteState<double> last_stance{this, "last_stance", {.doc = "its number; 0: none yet"}};
    DiscreteState<Eigen::Matrix3d> last_w_R_imu{
        this, "last_w_R_imu", {.doc = "orientation of the step before", .present = !imu->empty()}};
    Scratch<JacobianMatrix> J{this, [this] { return JacobianMatrix(6, value(v)); }};
    Scratch<Vector> weights{this, [this] { return Vector(value(k)); }};

    void infer(Inference& inference) const override {
        if (frames->empty()) inference.refuse("argument 'frames' is empty; name the frames that stand");
        refuse_twice(inference, "argument 'frames'", *frames);
        if (!robot.is_bound()) return;
        refuse_fixed_base(inference, model());
        find_frames(model(), *frames, frames_);
        if (!imu->empty()) imu_ = model().frame(*imu);
    }
    Status output(Now at, Out out) const noexcept override {
        Status good = all_finite(at, s, s_dot, contacts, w_H_b_0);
        if (good && at.is_connected(w_H_b_0)) good = is_rotation(at, w_H_b_0);
        if (good && w_R_imu.is_present()) {
            if (!(at.period() > 0)) return Status::failure("a continuous block has no period; give it one");
            good = all_finite(at, w_R_imu, gyroscope);
            if (good) good = is_rotation(at, w_R_imu);
        }
        if (!good) return good;
        const Stance now = find(at);
        dynamics::set_position(model(), data(at), now.w_H_b, at[s]);
        auto& standing = at[weights];
        standing = (at[contacts].array() > 0.5).select(Vector::Ones(at[contacts].size()), 0.0);
        standing[now.number] = 1.0;
        Vector6 velocity;
        if (w_R_imu.is_present())
            dynamics::base_velocity_from_points(model(), data(at), frames_, standing, base_turns(at),
                                                at[s_dot], velocity, at[J]);
        else
            dynamics::base_velocity_from_contacts(model(), data(at), frames_, standing, at[s_dot], velocity,
                                                  at[J]);
        out[w_H_b] = now.w_H_b;
        out[v_b] = velocity;
        out[stance] = now.number + 1;
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        const Stance now = find(at);
        next[w_H_stance] = now.pose;
        next[last_stance] = now.number + 1;
        if (w_R_imu.is_present()) next[last_w_R_imu] = at[w_R_imu];
        return ok;
    }

  private:
    struct Stance {
        int number; ///< from 0
        Transform pose, w_H_b;
    };
    Stance find(Now at) const noexcept {
        auto& of_robot = data(at);
        dynamics::set_joint_position(model(), of_robot, at[s]);
        const int wanted = strongest(at[contacts]), before = static_cast<int>(at[last_stance]) - 1;
        Stance now{before, at[w_H_stance], Transform::Identity()};
        const auto frame = [&] { return frames_[static_cast<std::size_t>(now.number)]; };
        if (before < 0) {
            now.number = wanted < 0 ? 0 : wanted;
            now.pose.setIdentity();
            if (at.is_connected(w_H_b_0)) stand(of_robot, frame(), at[w_H_b_0], now.pose);
        }
        dynamics::base_from_frame(model(), of_robot, frame(), now.pose, now.w_H_b);
        if (w_R_imu.is_present()) turn(at, of_robot, frame(), now);
        // The next step goes on from the frame that stands now.
        if (wanted >= 0 && !(at[contacts][now.number] > 0.5)) {
            now.number = wanted;
            stand(of_robot, frame(), now.w_H_b, now.pose);
        }
        return now;
    }
    void stand(dynamics::Data& of_robot, dynamics::Frame frame, const Eigen::Ref<const Transform>& base,
               Transform& pose) const noexcept {
        Transform b_H_f;
        dynamics::relative_transform(model(), of_robot, model().frame(model().base_link()), frame, b_H_f);
        pose.noalias() = base.lazyProduct(b_H_f);
    }
    /// The frame stays where it is and takes the orientation that the sensor tells.
    void turn(Now at, dynamics::Data& of_robot, dynamics::Frame frame, Stance& now) const noexcept {
        Transform imu_H_f, imu_H_b;
        dynamics::relative_transform(model(), of_robot, imu_, frame, imu_H_f);
        dynamics::relative_transform(model(), of_robot, imu_, model().frame(model().base_link()), imu_H_b);
        const Eigen::Matrix3d R = at[w_R_imu];
        now.pose.topLeftCorner<3, 3>() = R * imu_H_f.topLeftCorner<3, 3>();
        now.w_H_b.topLeftCorner<3, 3>() = R * imu_H_b.topLeftCorner<3, 3>();
        now.w_H_b.topRightCorner<3, 1>() =
            now.pose.topRightCorner<3, 1>() +
            R * (imu_H_b.topRightCorner<3, 1>() - imu_H_f.topRightCorner<3, 1>());
    }

    /// Angular velocity of the base, world axes: that of the sensor, and of the joints between the two.
    Vector3 base_turns(Now at) const noexcept {
        const Eigen::Matrix3d R = at[w_R_imu];
        Vector3 omega = Vector3::Zero();
        if (at.is_connected(gyroscope))
            omega = R * at[gyroscope];
        else if (at[last_stance] > 0)
            omega = dynamics::rotation_log(R * at[last_w_R_imu].transpose()) / at.period();
        auto of_joints = at[J].rightCols(at[s_dot].size());
        dynamics::relative_jacobian(model(), data(at), imu_, model().frame(model().base_link()), of_joints);
        Vector6 relative;
        relative.noalias() = of_joints.lazyProduct(at[s_dot]);
        return omega + R * relative.tail<3>();
    }

    mutable std::vector<dynamics::Frame> frames_;
    mutable dynamics::Frame imu_;
};

class ContactEKF final : public RobotBlock {
  public:
    using RobotBlock::RobotBlock;
    FrameArgument imu{this, "imu", "frame of gyroscope and accelerometer"};
    Names frames{this, "frames", {.initial = {"l_sole", "r_sole"}, .doc = "frames whose origins stand"}};
    Dim k{this, "k", [this]() -> Dim::Names { return *frames; }};
    Dim errors{this, "e", [this] { return dynamics::ContactEkf::before_contacts + 3 * count(); }};
    Input<Vector> s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "joint positions"}};
    Input<Vector> s_dot{this, "s_dot", {.shape = {n}, .unit = unit<"rad/s">, .doc = "joint velocities"}};
    Input<Vector3> gyroscope{
        this, "gyroscope", {.unit = unit<"rad/s">, .doc = "angular velocity, axes of the imu"}};
    Input<Vector3> accelerometer{
        this,
        "accelerometer",
        {.unit = unit<"m/s2">, .doc = "acceleration minus gravity, axes of the imu; at rest 9.81 upwards"}};
    Input<Vector> contacts{this, "contacts", {.shape = {k}, .unit = any_unit, .doc = contacts_doc}};
    Input<Transform> w_H_b_0{this,
                             "w_H_b_0",
                             {.initial = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                              .unit = mixed_units,
                              .doc = "base pose of the first step; open: at the origin",
                              .optional = true}};
    Parameter<double> gyroscope_noise{
        this,
        "gyroscope_noise",
        {.initial = {0.01}, .minimum = 0, .maximum = largest, .unit = any_unit, .doc = "rad/s/√Hz"}};
    Parameter<double> accelerometer_noise{
        this,
        "accelerometer_noise",
        {.initial = {0.1}, .minimum = 0, .maximum = largest, .unit = any_unit, .doc = "m/s2/√Hz"}};
    Parameter<double> gyroscope_walk{this,
                                     "gyroscope_walk",
                                     {.initial = {1e-4},
                                      .minimum = 0,
                                      .maximum = largest,
                                      .unit = any_unit,
                                      .doc = "of the bias, rad/s2/√Hz"}};
    Parameter<double> accelerometer_walk{this,
                                         "accelerometer_walk",
                                         {.initial = {1e-3},
                                          .minimum = 0,
                                          .maximum = largest,
                                          .unit = any_unit,
                                          .doc = "of the bias, m/s3/√Hz"}};
    Parameter<double> contact_noise{this,
                                    "contact_noise",
                                    {.initial = {0.05},
                                     .minimum = 0,
                                     .maximum = largest,
                                     .unit = any_unit,
                                     .doc = "slip of what stands, m/s/√Hz"}};
    Parameter<double> joint_noise{this,
                                  "joint_noise",
                                  {.initial = {1e-3},
                                   .minimum = 0,
                                   .maximum = largest,
                                   .unit = unit<"rad">,
                                   .doc = "of each measured position"}};
    Parameter<double> kinematics_noise{this,
                                       "kinematics_noise",
                                       {.initial = {1e-3},
                                        .above = 0,
                                        .maximum = largest,
                                        .unit = unit<"m">,
                                        .doc = "of a contact's position seen from the imu"}};
    Parameter<Eigen::Matrix<double, 5, 1>> initial_deviation{
        this,
        "initial_deviation",
        {.initial = {0.05, 0.1, 0.01, 0.01, 0.1},
         .minimum = 0,
         .maximum = largest,
         .unit = mixed_units,
         .doc =
             "standard deviations at the start: orientation [rad], velocity [m/s], position [m], biases of "
             "gyroscope [rad/s] and accelerometer [m/s2]"}};
    Output<Transform> w_H_b{this, "w_H_b", {.unit = mixed_units, .doc = base_pose_doc}};
    Output<Vector6> v_b{this, "v_b", {.unit = mixed_units, .doc = base_velocity_doc}};
    Output<Vector6> bias{
        this, "bias", {.unit = mixed_units, .doc = "of gyroscope [rad/s] and accelerometer [m/s2]"}};
    Output<Matrix> points{this, "points", {.shape = {3, k}, .unit = unit<"m">, .doc = "where frames stand"}};
    Output<Matrix> covariance{this,
                              "covariance",
                              {.shape = {errors, errors},
                               .unit = mixed_units,
                               .doc = "of the right-invariant errors: orientation, velocity, position of the "
                                      "imu; biases of gyroscope and accelerometer; points"}};
    DiscreteState<Transform> pose{this, "pose", {.unit = mixed_units, .doc = "predicted, of the imu"}};
    DiscreteState<Vector3> velocity{
        this, "velocity", {.unit = unit<"m/s">, .doc = "predicted, of the imu, world axes"}};
    DiscreteState<Vector6> biases{this, "biases", {.unit = mixed_units, .doc = "predicted"}};
    DiscreteState<Matrix> stands{
        this, "stands", {.shape = {4, k}, .unit = mixed_units, .doc = "points, and whether there are"}};
    DiscreteState<Matrix> P{
        this, "P", {.shape = {errors, errors}, .unit = mixed_units, .doc = "predicted covariance"}};
    DiscreteState<bool> goes_on{this, "goes_on", {.doc = "there is a step before"}};
    struct Memory {
        dynamics::ContactEkf filter;
        JacobianMatrix J;
    };
    Scratch<Memory> memory{this, [this] {
                               return Memory{dynamics::ContactEkf(count()), JacobianMatrix(6, value(n))};
                           }};

    void infer(Inference& inference) const override {
        if (frames->empty()) inference.refuse("argument 'frames' is empty; name the frames that stand");
        refuse_twice(inference, "argument 'frames'", *frames);
        imu.resolve(robot);
        if (!robot.is_bound()) return;
        refuse_fixed_base(inference, model());
        find_frames(model(), *frames, frames_);
    }
    Status output(Now at, Out out) const noexcept override {
        if (!(at.period() > 0)) return Status::failure("a continuous block has no period; give it one");
        Status good = all_finite(at, s, s_dot, gyroscope, accelerometer, contacts, w_H_b_0);
        if (good) good = is_rotation(at, w_H_b_0);
        if (!good) return good;
        const auto& filter = corrected(at);
        if (!filter.P.allFinite() || !filter.p.allFinite())
            return Status::failure(
                "the estimate diverged; look at the noise parameters and the measurements");
        Transform imu_H_b;
        dynamics::relative_transform(model(), data(at), imu.frame, base(), imu_H_b);
        auto& J = at[memory].J;
        dynamics::relative_jacobian(model(), data(at), imu.frame, base(), J);
        Vector6 relative;
        relative.noalias() = J.lazyProduct(at[s_dot]);
        const Vector3 omega = filter.R * (at[gyroscope] - filter.gyroscope_bias);
        const Vector3 arm = filter.R * imu_H_b.topRightCorner<3, 1>();
        auto H = out[w_H_b];
        H.setIdentity();
        H.topLeftCorner<3, 3>() = filter.R * imu_H_b.topLeftCorner<3, 3>();
        H.topRightCorner<3, 1>() = filter.p + arm;
        out[v_b].head<3>() = filter.v + omega.cross(arm) + filter.R * relative.head<3>();
        out[v_b].tail<3>() = omega + filter.R * relative.tail<3>();
        out[bias] << filter.gyroscope_bias, filter.accelerometer_bias;
        out[points] = filter.d;
        out[covariance] = filter.P;
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        auto& filter = corrected(at);
        filter.predict(at[gyroscope], at[accelerometer], at.period());
        next[pose].setIdentity();
        next[pose].topLeftCorner<3, 3>() = filter.R;
        next[pose].topRightCorner<3, 1>() = filter.p;
        next[velocity] = filter.v;
        next[biases] << filter.gyroscope_bias, filter.accelerometer_bias;
        next[stands].topRows<3>() = filter.d;
        next[stands].row(3) = filter.is_standing.transpose();
        next[P] = filter.P;
        next[goes_on] = true;
        return ok;
    }

  private:
    int count() const { return static_cast<int>(frames->size()); }
    dynamics::Frame base() const { return model().frame(model().base_link()); }

    /// The filter of this step with its measurements taken.
    dynamics::ContactEkf& corrected(Now at) const noexcept {
        auto& of_robot = data(at);
        auto& [filter, J] = at[memory];
        dynamics::set_joint_position(model(), of_robot, at[s]);
        filter.noise = {at[gyroscope_noise], at[accelerometer_noise], at[gyroscope_walk],
                        at[accelerometer_walk], at[contact_noise]};
        filter.gravity = model().gravity();
        if (at[goes_on]) {
            filter.R = at[pose].topLeftCorner<3, 3>();
            filter.p = at[pose].topRightCorner<3, 1>();
            filter.v = at[velocity];
            filter.gyroscope_bias = at[biases].head<3>();
            filter.accelerometer_bias = at[biases].tail<3>();
            filter.d = at[stands].topRows<3>();
            filter.is_standing = at[stands].row(3).transpose();
            filter.P = at[P];
        } else {
            Transform b_H_imu;
            dynamics::relative_transform(model(), of_robot, base(), imu.frame, b_H_imu);
            const Transform start = at[w_H_b_0].lazyProduct(b_H_imu);
            filter.R = start.topLeftCorner<3, 3>();
            filter.p = start.topRightCorner<3, 1>();
            filter.v.setZero();
            filter.gyroscope_bias.setZero();
            filter.accelerometer_bias.setZero();
            filter.d.setZero();
            filter.is_standing.setZero();
            filter.P.setZero();
            for (int i = 0; i < 5; ++i)
                filter.P.diagonal().segment<3>(3 * i).setConstant(at[initial_deviation][i] *
                                                                  at[initial_deviation][i]);
        }
        const double joint = at[joint_noise] * at[joint_noise],
                     own = at[kinematics_noise] * at[kinematics_noise];
        for (int i = 0; i < count(); ++i) {
            Transform imu_H_f;
            const auto frame = frames_[static_cast<std::size_t>(i)];
            dynamics::relative_transform(model(), of_robot, imu.frame, frame, imu_H_f);
            dynamics::relative_jacobian(model(), of_robot, imu.frame, frame, J);
            Eigen::Matrix3d noise;
            noise.noalias() = joint * J.topRows<3>().lazyProduct(J.topRows<3>().transpose());
            noise.diagonal().array() += own;
            filter.correct(i, at[contacts][i] > 0.5, imu_H_f.topRightCorner<3, 1>(), noise);
        }
        return filter;
    }

    mutable std::vector<dynamics::Frame> frames_;
};

} // namespace

void add_estimators(Library& library) {
    library.group("estimators")
        .add<MomentumObserver>(
            "MomentumObserver",
            "External forces from the momentum p = M nu, without accelerations: r = sum J' f of all that "
            "tau, gravity and the known wrenches do not explain, seen through a filter of bandwidth gain, "
            "dr/dt = K (dp/dt - C' nu + g - [0; tau] - sum J' f_known - r), and the wrenches on `frames` "
            "that explain r best in the sense of least squares. Friction of joints that tau does not contain "
            "counts as external. Source: A. De Luca, A. Albu-Schäffer, S. Haddadin, G. Hirzinger, Collision "
            "detection and safe reaction with the DLR-III lightweight manipulator arm, 2006. Errors: a frame "
            "that the robot does not have; in a step, an input that is not finite, or a w_H_b whose rotation "
            "is none; no period.")
        .add<ContactWrenches>(
            "ContactWrenches",
            "Wrenches of contacts and joint torques from force/torque sensors, which cut the robot into "
            "parts, and the equations of motion of each part: what weight, acceleration and sensors leave "
            "acts on the contact in it. Several contacts of one part share that by least norm; what a part "
            "without any leaves is not explained. Source: F. Nori et al., iCub whole-body control through "
            "force regulation on rigid non-coplanar contacts, 2015. Errors: a sensor that is no fixed joint, "
            "a frame that the robot does not have; in a step, an input that is not finite, or a w_H_b whose "
            "rotation is none.")
        .add<LegOdometry>(
            "LegOdometry",
            "Pose and velocity of a floating base from the joints, as long as some frame stands: the frame "
            "that holds the robot stays where it is, and when it no longer stands, another one that does "
            "takes over where it is then. With imu the orientation is measured, and the frame stays with its "
            "origin alone. The velocity is that for which all standing frames move least: as surfaces, or "
            "with imu, whose angular velocity is measured, their origins. Where none stands, the last one is "
            "taken to stand. Source: M. Bloesch et al., State estimation for legged robots: consistent "
            "fusion of leg kinematics and IMU, 2012, for the kinematics. Errors: a frame that the robot does "
            "not have, a fixed base; in a step, an input that is not finite, or a rotation that is none; imu "
            "without a period.")
        .add<ContactEKF>(
            "ContactEKF",
            "Pose and velocity of a floating base by an invariant extended Kalman filter over an inertial "
            "sensor and frames that stand: orientation R, velocity and position of the imu, points of "
            "contact and biases, with right-invariant errors; measured are the points seen from the imu "
            "through the joints. A frame that comes to stand becomes a new point. Yaw and position are not "
            "observable and keep the uncertainty of the start. Source: R. Hartley, M. Ghaffari, R. M. "
            "Eustice, J. W. Grizzle, Contact-aided invariant extended Kalman filtering for robot state "
            "estimation, 2020. Errors: a frame that the robot does not have, a fixed base; in a step, an "
            "input that is not finite, or an estimate that diverges; no period.");
}

} // namespace bf::toolbox
