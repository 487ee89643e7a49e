#include "rigid_body/rigid_body.hpp"

#include "rigid_body/robot_block.hpp"

namespace bf::toolbox {

namespace {

constexpr Unit meter = unit<"m">;

/// Is it the changes of a quantity that are computed?
template <class State> constexpr bool is_varied = std::is_same_v<State, dynamics::Variation>;
/// A matrix of six rows as the functions of dynamics take it, and its changes, which have rows of elements.
Eigen::Map<Eigen::Matrix<double, 6, Eigen::Dynamic>> six_rows(Eigen::Map<Matrix> map) {
    return {map.data(), 6, map.cols()};
}
Matrix& six_rows(Matrix& changes) { return changes; }

class ForwardKinematics final : public QuantityOf<PositionBlock, ForwardKinematics> {
  public:
    using QuantityOf::QuantityOf;
    FrameArgument frame{this, "frame", "name of a link or frame, or com"};
    Output<Transform> w_H_frame{
        this,
        "w_H_frame",
        {.unit = mixed_units, .doc = "pose of the frame in the world; for com its rotation is the identity"}};

    void infer(Inference&) const override { frame.resolve(robot, true); }
    template <class State, class To> void compute(State& d, To& to) const {
        if (!frame.is_com) {
            dynamics::forward_kinematics(model(), d, frame.frame, to[w_H_frame]);
        } else if constexpr (is_varied<State>) {
            dynamics::center_of_mass(model(), d, to[w_H_frame].middleRows(12, 3)); // its last column
        } else {
            auto H = to[w_H_frame];
            H.setIdentity();
            dynamics::center_of_mass(model(), d, H.template topRightCorner<3, 1>());
        }
    }
};

class CenterOfMass final : public QuantityOf<VelocityBlock, CenterOfMass> {
  public:
    using QuantityOf::QuantityOf;
    Output<Vector3> com{this, "com", {.unit = meter, .doc = "centre of mass in the world"}};
    Output<Vector3> com_dot{this, "com_dot", {.unit = unit<"m/s">, .doc = "its velocity, world axes"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::center_of_mass(model(), d, to[com]);
        dynamics::center_of_mass_velocity(model(), d, to[com_dot]);
    }
};

class Jacobian final : public QuantityOf<PositionBlock, Jacobian> {
  public:
    using QuantityOf::QuantityOf;
    FrameArgument frame{this, "frame", "name of a link or frame, or com"};
    Output<Matrix> J{
        this,
        "J",
        {.shape = {6, v},
         .unit = mixed_units,
         .doc =
             "J nu = [origin velocity; angular velocity], world axes; for com the last three rows are zero"}};

    void infer(Inference&) const override { frame.resolve(robot, true); }
    template <class State, class To> void compute(State& d, To& to) const {
        if (!frame.is_com) return dynamics::jacobian(model(), d, frame.frame, six_rows(to[J]));
        // Rows 1 to 3 hold the centre of mass.
        if constexpr (is_varied<State>) {
            Matrix changes(3 * model().velocities(), to.directions());
            dynamics::com_jacobian(model(), d, changes);
            for (int column = 0; column < model().velocities(); ++column)
                to[J].middleRows(6 * column, 3) = changes.middleRows(3 * column, 3);
        } else {
            // It is packed, so it is spread from the back.
            auto map = to[J];
            Eigen::Map<Eigen::Matrix<double, 3, Eigen::Dynamic>> packed(map.data(), 3, map.cols());
            dynamics::com_jacobian(model(), d, packed);
            for (Eigen::Index column = map.cols() - 1; column >= 0; --column) {
                const Vector3 value = packed.col(column);
                map.col(column) << value, 0, 0, 0;
            }
        }
    }
};

class DotJNu final : public QuantityOf<VelocityBlock, DotJNu> {
  public:
    using QuantityOf::QuantityOf;
    FrameArgument frame{this, "frame", "name of a link or frame, or com"};
    Output<Vector6> J_dot_nu{
        this,
        "J_dot_nu",
        {.unit = mixed_units,
         .doc = "bias acceleration [linear; angular], world axes; for com the last three are zero"}};

    void infer(Inference&) const override { frame.resolve(robot, true); }
    template <class State, class To> void compute(State& d, To& to) const {
        auto&& a = to[J_dot_nu];
        if (!frame.is_com) return dynamics::bias_acceleration(model(), d, frame.frame, a);
        a.setZero();
        dynamics::com_bias_acceleration(model(), d, a.template topRows<3>());
    }
};

class MassMatrix final : public QuantityOf<PositionBlock, MassMatrix> {
  public:
    using QuantityOf::QuantityOf;
    Output<Matrix> M{this,
                     "M",
                     {.shape = {v, v},
                      .unit = mixed_units,
                      .doc = "linear [kg], coupling [kg.m], angular [kg.m2]; both triangles"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::mass_matrix(model(), d, to[M]);
    }
};

class InverseDynamics final : public VelocityBlock, public Differentiable {
  public:
    using VelocityBlock::VelocityBlock;
    Input<Vector6> v_b_dot{
        this,
        "v_b_dot",
        {.unit = mixed_units,
         .doc = "time derivative of the mixed base velocity; zero for a fixed base, which needs none"}};
    Input<Vector> s_ddot{
        this, "s_ddot", {.shape = {n}, .unit = unit<"rad/s2">, .doc = "joint accelerations"}};
    Output<Vector> tau{
        this,
        "tau",
        {.shape = {v},
         .unit = mixed_units,
         .doc = "of a floating base: wrench [N; Nm] at its origin, world axes; joint torques [Nm]"}};

    bool needs(int input) const override {
        return VelocityBlock::needs(input) && !(input == v_b_dot.index() && base_is_fixed());
    }
    Status evaluate(Now at, Out out) const noexcept override {
        const Vector6 base = model().has_floating_base() ? Vector6(at[v_b_dot]) : Vector6(Vector6::Zero());
        dynamics::inverse_dynamics(model(), at_state(at), base, at[s_ddot], out[tau]);
        return ok;
    }
    bool directional_derivative(Now at, Changes& changes) const override {
        const bool floats = model().has_floating_base();
        const Vector6 base = floats ? Vector6(at[v_b_dot]) : Vector6(Vector6::Zero());
        const Matrix still;
        dynamics::inverse_dynamics(model(), at_state(at, changes), base, at[s_ddot],
                                   floats ? changes[v_b_dot] : still, changes[s_ddot], changes[tau]);
        return true;
    }
};

class ForwardDynamics final : public VelocityBlock, public Differentiable {
  public:
    using VelocityBlock::VelocityBlock;
    Argument<std::vector<std::string>> frames{
        this, "frames", {.doc = "links or frames on which external wrenches act"}};
    Input<Vector> tau{this, "tau", {.shape = {n}, .unit = unit<"Nm">, .doc = "joint torques"}};
    InputList<Vector6> wrench{
        this,
        prefixed("wrench_", *frames),
        {.unit = mixed_units, .doc = "on the frame: force [N], moment about its origin [Nm]; world axes"}};
    Output<Vector6> v_b_dot{
        this,
        "v_b_dot",
        {.unit = mixed_units, .doc = "time derivative of the mixed base velocity; zero for a fixed base"}};
    Output<Vector> s_ddot{
        this, "s_ddot", {.shape = {n}, .unit = unit<"rad/s2">, .doc = "joint accelerations"}};
    Scratch<Vector> forces{this, [this] { return Vector(value(v)); }};
    Scratch<Vector> nu_dot{this, [this] { return Vector(value(v)); }};

    void infer(Inference&) const override {
        if (!robot.is_bound()) return;
        resolved_.clear();
        for (const std::string& name : *frames) resolved_.push_back(model().frame(name));
    }
    Status evaluate(Now at, Out out) const noexcept override {
        auto& d = at_state(at);
        Vector &all = at[forces], &result = at[nu_dot];
        const Eigen::Index joints = at[tau].size(), base = all.size() - joints;
        all.head(base).setZero();
        all.tail(joints) = at[tau];
        for (int i = 0; i < wrench.size(); ++i)
            dynamics::add_wrench(model(), d, resolved_[static_cast<std::size_t>(i)], at[wrench[i]], all);
        if (const int row = dynamics::forward_dynamics(model(), d, all, result); row >= 0)
            return row < base ? Status::failure("the mass matrix is singular: {element} accelerates no mass",
                                                v_b_dot, row)
                              : Status::failure("the mass matrix is singular: {element} accelerates no mass; "
                                                "give the link that it moves inertia, or leave the joint out",
                                                s_ddot, row - static_cast<int>(base));
        out[v_b_dot].setZero();
        out[v_b_dot].head(base) = result.head(base);
        out[s_ddot] = result.tail(joints);
        return ok;
    }
    bool directional_derivative(Now at, Changes& changes) const override {
        auto& d = at_state(at, changes);
        const Eigen::Index joints = at[tau].size(), base = model().velocities() - joints;
        Matrix all = Matrix::Zero(base + joints, changes.directions()), result = all;
        all.bottomRows(joints) = changes.of(tau, joints);
        for (int i = 0; i < wrench.size(); ++i)
            dynamics::add_wrench(model(), d, resolved_[static_cast<std::size_t>(i)], at[wrench[i]],
                                 changes[wrench[i]], all);
        Vector nu_dot(base + joints);
        nu_dot.head(base) = at[v_b_dot].head(base);
        nu_dot.tail(joints) = at[s_ddot];
        dynamics::forward_dynamics(model(), d, nu_dot, all, result);
        changes[v_b_dot].topRows(base) = result.topRows(base);
        changes[s_ddot] = result.bottomRows(joints);
        return true;
    }

  private:
    mutable std::vector<dynamics::Frame> resolved_;
};

class GetBiasForces final : public QuantityOf<VelocityBlock, GetBiasForces> {
  public:
    using QuantityOf::QuantityOf;
    Output<Vector> h{
        this, "h", {.shape = {v}, .unit = mixed_units, .doc = "Coriolis, centrifugal and gravity terms"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::bias_forces(model(), d, to[h]);
    }
};

class GetGravityForces final : public QuantityOf<PositionBlock, GetGravityForces> {
  public:
    using QuantityOf::QuantityOf;
    Output<Vector> g{this, "g", {.shape = {v}, .unit = mixed_units, .doc = "bias forces at zero velocity"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::gravity_forces(model(), d, to[g]);
    }
};

class GetCoriolisForces final : public QuantityOf<VelocityBlock, GetCoriolisForces> {
  public:
    using QuantityOf::QuantityOf;
    Output<Vector> c{
        this, "c", {.shape = {v}, .unit = mixed_units, .doc = "bias forces without those of gravity"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::coriolis_forces(model(), d, to[c]);
    }
};

class CoriolisMatrix final : public QuantityOf<VelocityBlock, CoriolisMatrix> {
  public:
    using QuantityOf::QuantityOf;
    Output<Matrix> C{
        this, "C", {.shape = {v, v}, .unit = mixed_units, .doc = "C nu = Coriolis and centrifugal forces"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::coriolis_matrix(model(), d, to[C]);
    }
};

class MassMatrixDerivative final : public QuantityOf<VelocityBlock, MassMatrixDerivative> {
  public:
    using QuantityOf::QuantityOf;
    Output<Matrix> M_dot{
        this, "M_dot", {.shape = {v, v}, .unit = mixed_units, .doc = "time derivative of M; both triangles"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::mass_matrix_derivative(model(), d, to[M_dot]);
    }
};

class CentroidalMomentum final : public QuantityOf<VelocityBlock, CentroidalMomentum> {
  public:
    using QuantityOf::QuantityOf;
    Output<Vector6> H{
        this,
        "H",
        {.unit = mixed_units,
         .doc = "linear [kg.m/s] and angular [kg.m2/s] momentum about the centre of mass, world axes"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::centroidal_momentum(model(), d, to[H]);
    }
};

class CentroidalTotalMomentumMatrix final : public QuantityOf<PositionBlock, CentroidalTotalMomentumMatrix> {
  public:
    using QuantityOf::QuantityOf;
    Output<Matrix> A{this, "A", {.shape = {6, v}, .unit = mixed_units, .doc = "A nu = centroidal momentum"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::centroidal_momentum_matrix(model(), d, six_rows(to[A]));
    }
};

class DotANu final : public QuantityOf<VelocityBlock, DotANu> {
  public:
    using QuantityOf::QuantityOf;
    Output<Vector6> A_dot_nu{
        this,
        "A_dot_nu",
        {.unit = mixed_units, .doc = "linear [N] and angular [Nm] rate of momentum for nu_dot = 0"}};

    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::centroidal_momentum_bias(model(), d, to[A_dot_nu]);
    }
};

class RelativeTransform final : public QuantityOf<JointBlock, RelativeTransform> {
  public:
    using QuantityOf::QuantityOf;
    FrameArgument frame1{this, "frame1", "reference frame"};
    FrameArgument frame2{this, "frame2", "frame whose pose is wanted"};
    Output<Transform> frame1_H_frame2{
        this, "frame1_H_frame2", {.unit = mixed_units, .doc = "pose of frame2 seen from frame1"}};

    void infer(Inference&) const override {
        frame1.resolve(robot);
        frame2.resolve(robot);
    }
    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::relative_transform(model(), d, frame1.frame, frame2.frame, to[frame1_H_frame2]);
    }
};

class RelativeJacobian final : public QuantityOf<JointBlock, RelativeJacobian> {
  public:
    using QuantityOf::QuantityOf;
    FrameArgument reference{this, "reference", "reference frame"};
    FrameArgument frame{this, "frame", "frame whose velocity is wanted"};
    Output<Matrix> J{
        this,
        "J",
        {.shape = {6, n},
         .unit = mixed_units,
         .doc = "J s_dot = velocity of frame relative to reference: origin of frame, axes of reference"}};

    void infer(Inference&) const override {
        reference.resolve(robot);
        frame.resolve(robot);
    }
    template <class State, class To> void compute(State& d, To& to) const {
        dynamics::relative_jacobian(model(), d, reference.frame, frame.frame, six_rows(to[J]));
    }
};

} // namespace

void add_rigid_body(Library& library) {
    library.group("rigid body")
        .add<ForwardKinematics>("ForwardKinematics",
                                "Pose of a frame in the world, w_H_frame(w_H_b, s), 4x4. For the pseudo "
                                "frame com: the position of the centre of mass and the identity as rotation. "
                                "Errors: a frame that the robot does not have; the text lists similar ones.")
        .add<CenterOfMass>("CenterOfMass", "Position and velocity of the centre of mass, world axes. com = "
                                           "sum m_i c_i / sum m_i, com_dot = J_com nu.")
        .add<Jacobian>("Jacobian",
                       "Jacobian of a frame: J nu = [origin velocity; angular velocity], mixed "
                       "representation, 6 x (6+n); 6 x n for a fixed base, whose nu is s_dot. For the pseudo "
                       "frame com: rows 1 to 3 are the Jacobian of the centre of mass, rows 4 to 6 are zero. "
                       "Errors: a frame that the robot does not have; the text lists similar ones.")
        .add<DotJNu>("DotJNu", "Bias acceleration of a frame, d/dt(J) nu, mixed representation, 6 elements. "
                               "It is the acceleration of the frame for nu_dot = 0. For the pseudo frame "
                               "com: elements 1 to 3 are those of the centre of mass, 4 to 6 are zero. "
                               "Errors: a frame that the robot does not have; the text lists similar ones.")
        .add<MassMatrix>(
            "MassMatrix",
            "Mass matrix M of the robot, (6+n) x (6+n): kinetic energy = 1/2 nu' M nu; n x n for a fixed "
            "base. Source: R. Featherstone, Rigid Body Dynamics Algorithms, 2008, §6.2.")
        .add<InverseDynamics>(
            "InverseDynamics",
            "Generalised forces M nu_dot + h of a motion without external wrenches, 6+n elements. nu_dot = "
            "[v_b_dot; s_ddot]; the result is [base wrench; joint torques], for a fixed base the n joint "
            "torques alone. Source: R. Featherstone, Rigid Body Dynamics Algorithms, 2008, §5.3.")
        .add<ForwardDynamics>(
            "ForwardDynamics",
            "Accelerations of joint torques and external wrenches: M nu_dot + h = [0; tau] + sum J' f, with "
            "nu_dot = [v_b_dot; s_ddot] and a wrench f = [force; moment] on each of `frames`. It is the "
            "inverse of InverseDynamics. A fixed base does not accelerate. Source: R. Featherstone, Rigid "
            "Body Dynamics Algorithms, 2008, §6.5. Errors: a frame that the robot does not have; the text "
            "lists similar ones. In a step: a joint that moves links without inertia, by name.")
        .add<GetBiasForces>(
            "GetBiasForces",
            "Coriolis, centrifugal and gravity forces h(q, nu), 6+n elements, n for a fixed base. M nu_dot + "
            "h = [0; tau] + sum J' f; h is InverseDynamics with zero accelerations.")
        .add<GetGravityForces>("GetGravityForces",
                               "Gravity forces g(q) = h(q, 0), 6+n elements, n for a fixed base. It is "
                               "InverseDynamics with zero velocities and accelerations.")
        .add<GetCoriolisForces>(
            "GetCoriolisForces",
            "Coriolis and centrifugal forces c(q, nu) = h(q, nu) - g(q), 6+n elements, n for a fixed base: "
            "the bias forces without those of gravity.")
        .add<CoriolisMatrix>(
            "CoriolisMatrix",
            "Matrix C of the Coriolis and centrifugal forces, (6+n) x (6+n), n x n for a fixed base: C nu = "
            "c and dM/dt = C + C', so that dM/dt - 2C is skew-symmetric. Its entries for the joints are "
            "those of the Christoffel symbols; the first three columns of a floating base are zero. Source: "
            "S. Echeandia, P. M. Wensing, Numerical methods to compute the Coriolis matrix and Christoffel "
            "symbols for rigid-body systems, 2021.")
        .add<MassMatrixDerivative>(
            "MassMatrixDerivative",
            "Time derivative of the mass matrix, dM/dt = C + C' with the Coriolis matrix C, (6+n) x (6+n), "
            "n x n for a fixed base.")
        .add<CentroidalMomentum>("CentroidalMomentum",
                                 "Linear and angular momentum about the centre of mass, world axes, 6 "
                                 "elements. H = A nu with the centroidal momentum matrix A. Source: D. Orin, "
                                 "A. Goswami, S.-H. Lee, Centroidal dynamics of a humanoid robot, 2013.")
        .add<CentroidalTotalMomentumMatrix>(
            "CentroidalTotalMomentumMatrix",
            "Centroidal momentum matrix A, 6 x (6+n), 6 x n for a fixed base: A nu = momentum about the "
            "centre of mass, world axes. Source: D. Orin, A. Goswami, S.-H. Lee, Centroidal dynamics of a "
            "humanoid robot, 2013.")
        .add<DotANu>(
            "DotANu",
            "Bias of the centroidal momentum, d/dt(A) nu, 6 elements, world axes: the rate of the momentum H "
            "= A nu about the centre of mass for nu_dot = 0, dH/dt = A nu_dot + d/dt(A) nu.")
        .add<RelativeTransform>(
            "RelativeTransform",
            "Pose of one frame seen from another, frame1_H_frame2(s), 4x4; depends on the joint positions "
            "only. Errors: a frame that the robot does not have; the text lists similar ones.")
        .add<RelativeJacobian>("RelativeJacobian",
                               "Jacobian of the velocity of one frame relative to another, 6 x n. J s_dot = "
                               "[origin velocity; angular velocity] of `frame` relative to `reference`, in "
                               "the axes of `reference`; depends on the joint positions only. Errors: a "
                               "frame that the robot does not have; the text lists similar ones.");
}

} // namespace bf::toolbox
