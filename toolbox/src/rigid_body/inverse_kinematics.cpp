#include "bf/dynamics/inverse_kinematics.hpp"

#include "bf/core/interrupt.hpp"
#include "rigid_body/rigid_body.hpp"
#include "rigid_body/robot_block.hpp"

#include <Eigen/LU>

#include <cmath>

namespace bf::toolbox {

namespace {

class InverseKinematics final : public RobotBlock {
  public:
    using RobotBlock::RobotBlock;
    using Frames = Argument<std::vector<std::string>>;
    Frames position{this, "position", {.doc = "frames with a wanted position"}};
    Frames orientation{this, "orientation", {.doc = "frames with a wanted orientation"}};
    Frames pose{this, "pose", {.doc = "frames with a wanted position and orientation"}};
    Argument<bool> com{
        this, "com", {.initial = false, .doc = "the centre of mass has a wanted position, port com"}};
    Argument<bool> posture{
        this, "posture", {.initial = false, .doc = "the joints have wanted positions, port posture"}};
    Argument<bool> finds_base{
        this,
        "finds_base",
        {.initial = false, .doc = "the base moves, too; otherwise it is where it is said to be"}};
    Argument<int> iterations{
        this,
        "iterations",
        {.initial = 50, .minimum = 1, .maximum = 10'000, .doc = "most of one search: those of a step"}};
    Argument<int> restarts{this,
                           "restarts",
                           {.initial = 50,
                            .minimum = 0,
                            .maximum = 10'000,
                            .doc = "most searches that the first step adds from other postures"}};
    Argument<double> tolerance{
        this,
        "tolerance",
        {.initial = 1e-6, .above = 0, .doc = "m and rad, within which a target is reached"}};

    Dim t{this, "t", [this]() -> Dim::Names {
              std::vector<std::string> names = prefixed("p_", *position);
              for (const auto& name : prefixed("R_", *orientation)) names.push_back(name);
              for (const auto& name : prefixed("w_H_", *pose)) names.push_back(name);
              if (com) names.push_back("com");
              return names;
          }};
    Input<Transform> w_H_b_0{
        this,
        "w_H_b_0",
        {.initial = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
         .unit = mixed_units,
         .doc = "base pose: rotation [1], position [m]; with finds_base the one from which the first step "
                "searches; a fixed base without one is at the origin"}};
    Input<Vector> s_0{this,
                      "s_0",
                      {.shape = {n},
                       .unit = unit<"rad">,
                       .doc = "joint positions from which the first step searches",
                       .optional = true}};
    InputList<Vector3> p{this,
                         prefixed("p_", *position),
                         {.unit = unit<"m">, .doc = "wanted position of its origin in the world"}};
    InputList<Matrix> R{this,
                        prefixed("R_", *orientation),
                        {.shape = {3, 3}, .doc = "wanted orientation, axes of the frame in the world"}};
    InputList<Transform> w_H{
        this, prefixed("w_H_", *pose), {.unit = mixed_units, .doc = "wanted pose in the world"}};
    Input<Vector3> com_target{
        this,
        "com",
        {.unit = unit<"m">, .doc = "wanted position of the centre of mass in the world", .present = com}};
    Input<Vector> posture_target{
        this,
        "posture",
        {.shape = {n}, .unit = unit<"rad">, .doc = "wanted joint positions", .present = posture}};
    Parameter<Vector> weights{this,
                              "weights",
                              {.shape = {t},
                               .initial = {1},
                               .minimum = 0,
                               .unit = mixed_units,
                               .doc = "of the squared errors of the targets [1/m2, 1/rad2]; 0: not wanted",
                               .present = has_frames()}};
    Parameter<Vector> posture_weights{this,
                                      "posture_weights",
                                      {.shape = {n},
                                       .initial = {1e-3},
                                       .minimum = 0,
                                       .unit = unit<"1/rad2">,
                                       .doc = "of the squared errors of the joints",
                                       .present = posture}};
    Parameter<Vector> max_speed{this,
                                "max_speed",
                                {.shape = {n},
                                 .initial = {bf::Limits::infinity},
                                 .above = 0,
                                 .unit = unit<"rad/s">,
                                 .doc = "of each joint from one step to the next"}};
    Output<Vector> s{
        this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "joint positions within their limits"}};
    Output<Transform> w_H_b{this, "w_H_b", {.unit = mixed_units, .doc = "base pose"}};
    Output<double> status{
        this,
        "status",
        {.doc = "0 all targets reached, 1 stopped by the limit of iterations, 2 least error, not reached"}};
    Output<Matrix> error{
        this,
        "error",
        {.shape = {6, t},
         .unit = mixed_units,
         .doc = "what is left of each target: position [m], rotation vector [rad], world axes",
         .present = has_frames()}};
    DiscreteState<Vector> last_s{this, "last_s", {.shape = {n}, .unit = unit<"rad">, .doc = "last solution"}};
    DiscreteState<Transform> last_w_H_b{
        this, "last_w_H_b", {.unit = mixed_units, .doc = "and its base pose"}};
    DiscreteState<bool> goes_on{this, "goes_on", {.doc = "there is a last solution"}};
    Scratch<dynamics::InverseKinematics> solver{this, [this] {
                                                    return dynamics::InverseKinematics(
                                                        model(), targets_, finds_base,
                                                        {iterations, tolerance, is_interrupted});
                                                }};

    bool needs(int input) const override {
        return RobotBlock::needs(input) &&
               !(input == w_H_b_0.index() && robot.is_bound() && !model().has_floating_base());
    }
    void infer(Inference& inference) const override {
        if (!robot.is_bound()) return;
        if (!has_frames() && !posture)
            inference.refuse("it has no target; give position, orientation, pose, com or posture");
        if (finds_base && !model().has_floating_base())
            inference.refuse("finds_base is true, but the robot's base is fixed; leave it out, or let the "
                             "Configuration have floating_base: true");
        using Kind = dynamics::Target::Kind;
        targets_.clear();
        for (const auto& [frames, kind] :
             {std::pair(&*position, Kind::position), std::pair(&*orientation, Kind::orientation),
              std::pair(&*pose, Kind::pose)})
            for (const std::string& name : *frames) targets_.push_back({kind, model().frame(name)});
        if (com) targets_.push_back({Kind::center_of_mass, {}});
    }

    Status output(Now at, Out out) const noexcept override {
        auto& ik = at[solver];
        std::size_t i = 0;
        Status good = ok;
        const auto take = [&](const auto& key, auto&& part) {
            const auto value = at[key];
            for (Eigen::Index k = 0; k < value.size(); ++k)
                if (!std::isfinite(value.data()[k]) && good)
                    good = Status::failure("{element} is not finite; look at what computes it", key,
                                           static_cast<std::int32_t>(k));
            part = value;
        };
        const auto rotation = [&](const auto& key, const Eigen::Matrix4d& H) {
            const Eigen::Matrix3d R = H.topLeftCorner<3, 3>();
            if (good && !((R * R.transpose()).isIdentity(1e-3) && R.determinant() > 0))
                good = Status::failure(
                    "{element} holds no rotation; its first three columns must be orthonormal and "
                    "right-handed",
                    key, -1);
        };
        for (const auto& key : p) take(key, ik.targets[i++].pose.topRightCorner<3, 1>());
        for (const auto& key : R) {
            take(key, ik.targets[i].pose.topLeftCorner<3, 3>());
            rotation(key, ik.targets[i++].pose);
        }
        for (const auto& key : w_H) {
            take(key, ik.targets[i].pose);
            rotation(key, ik.targets[i++].pose);
        }
        if (com) take(com_target, ik.targets[i].pose.topRightCorner<3, 1>());
        if (posture) take(posture_target, ik.posture);
        auto found = out[s];
        auto base = out[w_H_b];
        const bool first = !at[goes_on];
        if (first)
            take(s_0, found);
        else
            found = at[last_s];
        if (first || !finds_base) {
            take(w_H_b_0, base);
            rotation(w_H_b_0, base);
        } else {
            base = at[last_w_H_b];
        }
        if (!good) return good;

        for (std::size_t k = 0; k < ik.targets.size(); ++k)
            ik.targets[k].weight = at[weights][static_cast<Eigen::Index>(k)];
        if (posture) ik.posture_weights = at[posture_weights];
        const auto speed = at[max_speed];
        ik.reach = speed.array().isInf().select(speed, speed * at.period()); // a period may be 0
        out[status] = static_cast<double>(first ? ik.search(base, found, restarts) : ik.follow(base, found));
        if (first && is_interrupted()) return Status::failure(interrupted);
        if (error.is_present()) out[error] = ik.error();
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[last_s] = at[s];
        next[last_w_H_b] = at[w_H_b];
        next[goes_on] = true;
        return ok;
    }

  private:
    bool has_frames() const { return !position->empty() || !orientation->empty() || !pose->empty() || com; }

    mutable std::vector<dynamics::Target> targets_;
};

} // namespace

void add_inverse_kinematics(Library& library) {
    library.group("rigid body")
        .add<InverseKinematics>(
            "InverseKinematics",
            "Joint positions within their limits, and with finds_base the base pose, at which frames and the "
            "centre of mass are nearest to their targets: min 1/2 sum w |e|^2 + 1/2 sum w_s (posture - s)^2 "
            "with the position errors p_target - p and the rotation vectors of R_target R', all in the "
            "world. Damped least squares, the damping in proportion to what is left of the cost. The first "
            "step (and the first after a reset) begins at s_0, and where that does not reach the targets, at "
            "other postures between the limits; later steps go on from the last solution and move no joint "
            "faster than max_speed. Out of reach it gives the least error near the last solution. Without a "
            "weighted posture joints that no target needs stay where they are; with one the solution is a "
            "compromise, the nearer to the targets the smaller posture_weights are. Source: T. Sugihara, "
            "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, 2011. Errors: a "
            "frame that the robot does not have (the text lists similar ones), no target, finds_base with a "
            "fixed base. In a step: a target that is not finite, or whose rotation is none, by name.");
}

} // namespace bf::toolbox
