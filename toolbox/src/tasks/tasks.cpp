#include "tasks/tasks.hpp"

#include "bf/dynamics/tasks.hpp"
#include "checks.hpp"
#include "rigid_body/robot_block.hpp"

namespace bf::toolbox {

namespace {

constexpr const char* task_rows_doc =
    "rows [A, lower, upper, weight] over nu_dot: A nu_dot from lower to upper, here equal";
using JacobianMatrix = Eigen::Matrix<double, 6, Eigen::Dynamic>;
constexpr const char* limit_rows_doc = "rows [A, lower, upper, weight]: A x from lower to upper";

/// What a task makes of an error and its derivative, and how much its rows count.
template <class T> struct Feedback {
    Feedback(Block* owner, const Shape& shape, const char* whose)
        : kp{owner,
             "kp",
             {.shape = shape,
              .initial = {100},
              .minimum = 0,
              .maximum = largest,
              .unit = unit<"1/s2">,
              .doc = "of the error"}},
          kd{owner,
             "kd",
             {.shape = shape,
              .initial = {20},
              .minimum = 0,
              .maximum = largest,
              .unit = unit<"1/s">,
              .doc = "of the velocity; 2 sqrt(kp) damps critically"}},
          weights{owner,
                  "weights",
                  {.shape = shape,
                   .initial = {1},
                   .minimum = 0,
                   .maximum = largest,
                   .unit = any_unit,
                   .doc = whose}} {}
    Parameter<T> kp, kd, weights;
};

class CartesianTask final : public VelocityBlock {
  public:
    using VelocityBlock::VelocityBlock;
    FrameArgument frame{this, "frame", "name of a link or frame"};
    Argument<std::string> what{this,
                               "what",
                               {.initial = "pose",
                                .doc = "what of the frame is wanted",
                                .choices = {"pose", "position", "orientation"}}};
    Dim t{this, "t", [this]() -> Dim::Names {
              std::vector<std::string> names;
              if (has_position()) names = {"x", "y", "z"};
              if (has_orientation()) names.insert(names.end(), {"rx", "ry", "rz"});
              return names;
          }};
    Input<Vector3> p_target{this,
                            "p_target",
                            {.unit = unit<"m">,
                             .doc = "wanted position of the origin in the world",
                             .present = *what == "position"}};
    Input<Eigen::Matrix3d> R_target{
        this,
        "R_target",
        {.doc = "wanted orientation, axes of the frame in the world", .present = *what == "orientation"}};
    Input<Transform> w_H_target{
        this,
        "w_H_target",
        {.unit = mixed_units, .doc = "wanted pose in the world", .present = *what == "pose"}};
    Input<Vector> v_target{this,
                           "v_target",
                           {.shape = {t},
                            .unit = mixed_units,
                            .doc = "wanted velocity [m/s; rad/s], world axes",
                            .optional = true}};
    Input<Vector> a_target{this,
                           "a_target",
                           {.shape = {t},
                            .unit = mixed_units,
                            .doc = "acceleration that is fed forward [m/s2; rad/s2], world axes",
                            .optional = true}};
    Feedback<Vector> feedback{this, {t}, "of the rows"};
    Output<Matrix> task{this, "task", {.shape = {t, v + 3}, .unit = mixed_units, .doc = task_rows_doc}};
    Output<Vector> error{this,
                         "error",
                         {.shape = {t},
                          .unit = mixed_units,
                          .doc = "position [m], rotation vector of R_target R' [rad], world axes"}};
    Scratch<JacobianMatrix> J{this, [this] { return JacobianMatrix(6, value(v)); }};

    void infer(Inference&) const override { frame.resolve(robot); }
    Status evaluate(Now at, Out out) const noexcept override {
        using Kind = dynamics::Target::Kind;
        Eigen::Matrix4d target = Eigen::Matrix4d::Identity();
        Kind kind = Kind::pose;
        Status good = all_finite(at, v_target, a_target);
        if (p_target.is_present()) {
            kind = Kind::position;
            if (good) good = all_finite(at, p_target);
            target.topRightCorner<3, 1>() = at[p_target];
        } else if (R_target.is_present()) {
            kind = Kind::orientation;
            if (good) good = all_finite(at, R_target);
            if (good) good = is_rotation(at, R_target);
            target.topLeftCorner<3, 3>() = at[R_target];
        } else {
            if (good) good = all_finite(at, w_H_target);
            if (good) good = is_rotation(at, w_H_target);
            target = at[w_H_target];
        }
        if (!good) return good;
        dynamics::cartesian_task(
            model(), at_state(at), frame.frame, kind, target,
            {at[v_target], at[a_target], at[feedback.kp], at[feedback.kd], at[feedback.weights]}, out[task],
            out[error], at[J]);
        return ok;
    }

  private:
    bool has_position() const { return *what != "orientation"; }
    bool has_orientation() const { return *what != "position"; }
};

class CenterOfMassTask final : public VelocityBlock {
  public:
    using VelocityBlock::VelocityBlock;
    Input<Vector3> p_target{this, "p_target", {.unit = unit<"m">, .doc = "wanted position in the world"}};
    Input<Vector3> v_target{
        this, "v_target", {.unit = unit<"m/s">, .doc = "wanted velocity, world axes", .optional = true}};
    Input<Vector3> a_target{
        this,
        "a_target",
        {.unit = unit<"m/s2">, .doc = "acceleration that is fed forward, world axes", .optional = true}};
    Feedback<Vector3> feedback{this, {}, "of the rows x y z"};
    Output<Matrix> task{this, "task", {.shape = {3, v + 3}, .unit = mixed_units, .doc = task_rows_doc}};
    Output<Vector3> error{this, "error", {.unit = unit<"m">, .doc = "p_target minus the centre of mass"}};

    Status evaluate(Now at, Out out) const noexcept override {
        if (const Status good = all_finite(at, p_target, v_target, a_target); !good) return good;
        dynamics::com_task(
            model(), at_state(at), at[p_target],
            {at[v_target], at[a_target], at[feedback.kp], at[feedback.kd], at[feedback.weights]}, out[task],
            out[error]);
        return ok;
    }
};

class MomentumTask final : public VelocityBlock {
  public:
    using VelocityBlock::VelocityBlock;
    Input<Vector6> H_target{this,
                            "H_target",
                            {.unit = mixed_units,
                             .doc = "wanted momentum [kg.m/s; kg.m2/s], the angular one about the centre of "
                                    "mass, world axes; open: zero",
                             .optional = true}};
    Input<Vector6> H_dot_target{
        this,
        "H_dot_target",
        {.unit = mixed_units, .doc = "rate that is fed forward [N; Nm], world axes", .optional = true}};
    Parameter<Vector6> k{
        this,
        "k",
        {.initial = {10}, .minimum = 0, .maximum = largest, .unit = unit<"1/s">, .doc = "of the error"}};
    Parameter<Vector6> weights{
        this,
        "weights",
        {.initial = {1},
         .minimum = 0,
         .maximum = largest,
         .unit = any_unit,
         .doc = "of the rows; [0 0 0 1 1 1] leaves the linear ones to a CenterOfMassTask"}};
    Output<Matrix> task{this, "task", {.shape = {6, v + 3}, .unit = mixed_units, .doc = task_rows_doc}};
    Output<Vector6> error{this, "error", {.unit = mixed_units, .doc = "H_target minus the momentum"}};

    Status evaluate(Now at, Out out) const noexcept override {
        if (const Status good = all_finite(at, H_target, H_dot_target); !good) return good;
        dynamics::momentum_task(model(), at_state(at), at[H_target], at[H_dot_target], at[k], at[weights],
                                out[task], out[error]);
        return ok;
    }
};

class PostureTask final : public RobotBlock {
  public:
    using RobotBlock::RobotBlock;
    Input<Vector> s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "joint positions"}};
    Input<Vector> s_dot{this, "s_dot", {.shape = {n}, .unit = unit<"rad/s">, .doc = "joint velocities"}};
    Input<Vector> s_target{this, "s_target", {.shape = {n}, .unit = unit<"rad">, .doc = "wanted positions"}};
    Input<Vector> s_dot_target{
        this,
        "s_dot_target",
        {.shape = {n}, .unit = unit<"rad/s">, .doc = "wanted velocities", .optional = true}};
    Input<Vector> s_ddot_target{this,
                                "s_ddot_target",
                                {.shape = {n},
                                 .unit = unit<"rad/s2">,
                                 .doc = "accelerations that are fed forward",
                                 .optional = true}};
    Feedback<Vector> feedback{this, {n}, "of the joints"};
    Output<Matrix> task{this, "task", {.shape = {n, v + 3}, .unit = mixed_units, .doc = task_rows_doc}};
    Output<Vector> error{this, "error", {.shape = {n}, .unit = unit<"rad">, .doc = "s_target - s"}};

    Status output(Now at, Out out) const noexcept override {
        if (const Status good = all_finite(at, s, s_dot, s_target, s_dot_target, s_ddot_target); !good)
            return good;
        dynamics::posture_task(
            model(), at[s], at[s_dot], at[s_target],
            {at[s_dot_target], at[s_ddot_target], at[feedback.kp], at[feedback.kd], at[feedback.weights]},
            out[task], out[error]);
        return ok;
    }
};

class RigidContact final : public VelocityBlock {
  public:
    using VelocityBlock::VelocityBlock;
    FrameArgument frame{this, "frame", "name of a link or frame"};
    Argument<std::string> contact{this,
                                  "contact",
                                  {.initial = "surface",
                                   .doc = "surface: no motion at all; point: that of the origin",
                                   .choices = {"surface", "point"}}};
    Parameter<double> damping{this,
                              "damping",
                              {.initial = {10},
                               .minimum = 0,
                               .maximum = largest,
                               .unit = unit<"1/s">,
                               .doc = "takes away what velocity there is"}};
    Output<Matrix> task{this, "task", {.shape = {rows(), v + 3}, .unit = mixed_units, .doc = task_rows_doc}};
    Scratch<JacobianMatrix> J{this, [this] { return JacobianMatrix(6, value(v)); }};

    void infer(Inference&) const override { frame.resolve(robot); }
    Status evaluate(Now at, Out out) const noexcept override {
        dynamics::rigid_contact(model(), at_state(at), frame.frame, at[damping], out[task], at[J]);
        return ok;
    }

  private:
    int rows() const { return *contact == "point" ? 3 : 6; }
};

class ContactLimits final : public PositionBlock {
  public:
    using PositionBlock::PositionBlock;
    FrameArgument frame{this, "frame",
                        "name of a link or frame; its z axis is the normal, from the world into the robot"};
    Argument<std::string> contact{this,
                                  "contact",
                                  {.initial = "surface",
                                   .doc = "surface: rows over a wrench; point: over a force",
                                   .choices = {"surface", "point"}}};
    Argument<int> faces{
        this,
        "faces",
        {.initial = 4, .minimum = 3, .maximum = 64, .doc = "of the pyramid inside the cone of friction"}};
    Argument<std::string> form{
        this,
        "form",
        {.initial = "rows",
         .doc = "rows: limits, for the solvers of tasks; inequalities: C f <= d, for a QP",
         .choices = {"rows", "inequalities"}}};
    Parameter<double> friction{
        this, "friction", {.initial = {0.5}, .minimum = 0, .doc = "Coulomb's coefficient"}};
    Parameter<double> min_force{
        this, "min_force", {.initial = {0}, .minimum = 0, .unit = unit<"N">, .doc = "of the normal force"}};
    Parameter<double> max_force{this,
                                "max_force",
                                {.initial = {bf::Limits::infinity},
                                 .minimum = 0,
                                 .at_least = min_force.index(),
                                 .unit = unit<"N">,
                                 .doc = "of the normal force"}};
    Parameter<double> torsion{this,
                              "torsion",
                              {.initial = {0.01},
                               .minimum = 0,
                               .unit = unit<"m">,
                               .doc = "|moment about the normal| is at most this times the normal force",
                               .present = is_surface()}};
    Parameter<Eigen::Vector2d> x{this,
                                 "x",
                                 {.initial = {-0.05, 0.05},
                                  .unit = unit<"m">,
                                  .doc = "from and to: centre of pressure along the x axis of the frame",
                                  .present = is_surface()}};
    Parameter<Eigen::Vector2d> y{this,
                                 "y",
                                 {.initial = {-0.02, 0.02},
                                  .unit = unit<"m">,
                                  .doc = "from and to: centre of pressure along the y axis of the frame",
                                  .present = is_surface()}};
    Output<Matrix> limits{
        this,
        "limits",
        {.shape = {rows(), wide() + 3}, .unit = mixed_units, .doc = limit_rows_doc, .present = has_rows()}};
    Output<Matrix> C{this,
                     "C",
                     {.shape = {rows() + 1, wide()},
                      .unit = mixed_units,
                      .doc = "C f <= d over the wrench f, world axes",
                      .present = !has_rows()}};
    Output<Vector> d{this,
                     "d",
                     {.shape = {rows() + 1},
                      .unit = unit<"N">,
                      .doc = "inf in the row of a normal force without a largest one",
                      .present = !has_rows()}};

    void infer(Inference&) const override { frame.resolve(robot); }
    Status evaluate(Now at, Out out) const noexcept override {
        Transform H;
        dynamics::forward_kinematics(model(), at_state(at), frame.frame, H);
        dynamics::ContactLimits of;
        of.faces = faces;
        of.friction = at[friction];
        of.min_force = at[min_force];
        of.max_force = at[max_force];
        if (is_surface()) {
            of.torsion = at[torsion];
            of.x_min = at[x][0];
            of.x_max = at[x][1];
            of.y_min = at[y][0];
            of.y_max = at[y][1];
            if (of.x_min > of.x_max)
                return Status::failure("x goes from a larger to a smaller value; exchange them");
            if (of.y_min > of.y_max)
                return Status::failure("y goes from a larger to a smaller value; exchange them");
        }
        if (has_rows())
            dynamics::contact_limits(H.topLeftCorner<3, 3>(), of, out[limits]);
        else
            dynamics::contact_inequalities(H.topLeftCorner<3, 3>(), of, out[C], out[d]);
        return ok;
    }

  private:
    bool has_rows() const { return *form == "rows"; }
    int wide() const { return is_surface() ? 6 : 3; }
    int rows() const { return dynamics::contact_rows(is_surface(), faces); }
    bool is_surface() const { return *contact == "surface"; }
};

class JointLimits final : public RobotBlock {
  public:
    using RobotBlock::RobotBlock;
    Input<Vector> s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "joint positions"}};
    Input<Vector> s_dot{this, "s_dot", {.shape = {n}, .unit = unit<"rad/s">, .doc = "joint velocities"}};
    Parameter<Vector> max_acceleration{this,
                                       "max_acceleration",
                                       {.shape = {n},
                                        .initial = {100},
                                        .above = 0,
                                        .maximum = 1e9,
                                        .unit = unit<"rad/s2">,
                                        .doc = "that a joint may have, and can brake with at any time"}};
    Parameter<Vector> max_speed{this,
                                "max_speed",
                                {.shape = {n},
                                 .initial = {bf::Limits::infinity},
                                 .above = 0,
                                 .unit = unit<"rad/s">,
                                 .doc = "besides those of the URDF"}};
    Parameter<Vector> margin{this,
                             "margin",
                             {.shape = {n},
                              .initial = {0},
                              .minimum = 0,
                              .unit = unit<"rad">,
                              .doc = "kept from the position limits of the URDF"}};
    Parameter<double> horizon{this,
                              "horizon",
                              {.initial = {0},
                               .minimum = 0,
                               .unit = unit<"s">,
                               .doc = "over which an acceleration is held; 0: the block's period"}};
    Parameter<Vector> weights{this,
                              "weights",
                              {.shape = {n},
                               .initial = {1},
                               .minimum = 0,
                               .maximum = largest,
                               .unit = any_unit,
                               .doc = "of the joints"}};
    Output<Matrix> limits{this, "limits", {.shape = {n, v + 3}, .unit = mixed_units, .doc = limit_rows_doc}};

    Status output(Now at, Out out) const noexcept override {
        if (const Status good = all_finite(at, s, s_dot); !good) return good;
        const double T = at[horizon] > 0 ? at[horizon] : at.period();
        if (!(T > 0)) return Status::failure("a continuous block has no period; give a horizon, or a period");
        auto rows = out[limits];
        const auto& m = model();
        const Eigen::Index a = m.velocities(), joints = m.joints();
        rows.leftCols(a - joints).setZero();
        rows.middleCols(a - joints, joints).setIdentity();
        for (Eigen::Index i = 0; i < joints; ++i) {
            const auto bounds = dynamics::acceleration_bounds(
                at[s][i], at[s_dot][i], m.position_min()[i] + at[margin][i],
                m.position_max()[i] - at[margin][i], std::min(m.velocity_max()[i], at[max_speed][i]),
                at[max_acceleration][i], T);
            rows(i, a) = bounds.lower;
            rows(i, a + 1) = bounds.upper;
        }
        rows.col(a + 2) = at[weights];
        return ok;
    }
};

} // namespace

void add_tasks(Library& library) {
    library.group("task space")
        .add<CartesianTask>(
            "CartesianTask",
            "A frame follows a position, an orientation or a pose: J nu_dot = a_target + kd (v_target - J "
            "nu) + kp e - J_dot nu, all in world axes, with e = p_target - p and the rotation vector of "
            "R_target R', the logarithm in SO(3). A task is a matrix of rows [A, lower, upper, weight], "
            "which ConcatenateMatrices joins and HierarchicalQP and TaskSpaceInverseDynamics solve; a row of "
            "weight 0 asks for nothing. Source: L. Sciavicco, B. Siciliano, Modelling and Control of Robot "
            "Manipulators, 2000, ch. 6. Errors: a frame that the robot does not have (the text lists similar "
            "ones). In a step: a target that is not finite, or whose rotation is none.")
        .add<CenterOfMassTask>("CenterOfMassTask",
                               "The centre of mass follows a position: J_com nu_dot = a_target + kd "
                               "(v_target - com_dot) + kp (p_target - com) - J_com_dot nu, 3 rows [A, lower, "
                               "upper, weight], world axes. Errors: in a step, a target that is not finite.")
        .add<MomentumTask>(
            "MomentumTask",
            "The centroidal momentum follows a target: A nu_dot = H_dot_target + k (H_target - H) - A_dot "
            "nu, 6 rows [A, lower, upper, weight], linear and angular about the centre of mass, world axes. "
            "Source: D. Orin, A. Goswami, S.-H. Lee, Centroidal dynamics of a humanoid robot, 2013. Errors: "
            "in a step, a target that is not finite.")
        .add<PostureTask>(
            "PostureTask",
            "The joints follow positions: s_ddot = s_ddot_target + kd (s_dot_target - s_dot) + kp (s_target "
            "- s), n rows [A, lower, upper, weight]. Errors: in a step, an input that is not finite.")
        .add<RigidContact>("RigidContact",
                           "A frame that touches the world and does not slip: J nu_dot = -J_dot nu - damping "
                           "J nu, 6 rows [A, lower, upper, weight] of a surface, 3 of a point. "
                           "TaskSpaceInverseDynamics has these rows of its own contacts already. Errors: a "
                           "frame that the robot does not have; the text lists similar ones.")
        .add<ContactLimits>(
            "ContactLimits",
            "What a contact transmits, as rows [A, lower, upper, weight] over its wrench f, world axes: a "
            "pyramid inside the cone of friction, whose faces bound cos(t) f_x + sin(t) f_y by friction "
            "cos(pi/faces) f_z, and the normal force; of a surface also torsion and the centre of pressure "
            "(-m_y, m_x)/f_z within a rectangle; in the axes of the frame; or the same as C f <= d. Source: "
            "S. Caron, Q.-C. Pham, Y. Nakamura, Stability of surface contacts for humanoid robots, 2015. "
            "Errors: a frame that the robot does not have; the text lists similar ones. In a step: a "
            "rectangle that ends before it begins.")
        .add<JointLimits>(
            "JointLimits",
            "Limits of position and speed as limits of joint accelerations, n rows [A, lower, upper, "
            "weight]: those which, held over a period, keep each joint within the limits of the URDF, and "
            "from which it can stay within them for ever without more than max_acceleration. Where that is "
            "impossible, or outside, they ask for the strongest braking; as a task of the first level they "
            "are never infeasible. Source: A. Del Prete, Joint position and velocity bounds in discrete-time "
            "acceleration/torque control of robot arms, 2018. Errors: in a step, an input that is not "
            "finite; no period and no horizon.");
}

} // namespace bf::toolbox
