// Blocks over a world of several robots and objects.
#include "bf/toolbox/shared_world.hpp"

#include "BlockFactory/Core/Log.h"
#include "bf/core/block.hpp"
#include "rigid_body/robot_block.hpp"
#include "world/simulated.hpp"
#include "world/world.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace bf::toolbox {

namespace {

/// A robot of a shared world, which saves all there is.
class WorldRobotDevice final : public SimulatedAs<RobotDevice> {
  public:
    WorldRobotDevice(const SharedWorld& world, int robot)
        : SimulatedAs(world.scene, robot, world.sensors[static_cast<std::size_t>(robot)], "robot") {}
    const void* identity() const override {
        return &scene_->options().robots[static_cast<std::size_t>(robot_)];
    }
    std::shared_ptr<RobotConnection> open() const override {
        return std::make_shared<SimulatedConnection>(robot_, sensors_);
    }
};

class World final : public Block {
  public:
    using Block::Block;
    Argument<std::string> file{this, "file", {.doc = "XML file that lists the world's robots and objects"}};
    Provides<SharedWorld> world{this, [this] { return read(); }};
    Dim nq{this, "nq", [this]() -> Dim::Names {
               const auto* made =
                   static_cast<const SharedWorld*>(resolution().find_provided(SharedWorld::resource));
               if (!made) return std::nullopt;
               return made->scene->position_names();
           }};
    Output<Vector> q{this,
                     "q",
                     {.shape = {nq},
                      .unit = mixed_units,
                      .doc = "all positions of the world, by which it is drawn: for each body that floats x "
                             "y z [m] and a quaternion w x y z, for each joint rad or m"}};
    Scratch<int> substeps{this, [] { return 1; }};

    void start(Now at) const override {
        const double step = at[world].simulation.scene().options().time_step;
        const double count = std::round(at.period() / step);
        if (count < 1 || count > 1e6 || std::abs(count * step - at.period()) > 1e-9 * at.period()) {
            std::ostringstream text;
            text << "the world's period is " << at.period() << " s, which is no multiple of its time step of "
                 << step << " s; set step in the file or the block's period";
            throw std::runtime_error(text.str());
        }
        at[substeps] = static_cast<int>(count);
        at[world].simulation.reset();
    }
    Status output(Now at, Out out) const noexcept override {
        out[q] = at[world].simulation.q();
        return ok;
    }
    Status update(Now at, Next) const noexcept override {
        if (at[world].simulation.step(at[substeps])) return ok;
        return failed_step(at[world].simulation.failure());
    }

  private:
    std::shared_ptr<const SharedWorld> read() const {
        if (file->empty())
            throw std::runtime_error("argument 'file' is empty; give an XML file that describes the world");
        auto made = std::make_shared<SharedWorld>();
        made->file = path_of(*file);
        made->search_directories = {path_of("."), std::filesystem::path(BF_ROBOT_MODELS),
                                    std::filesystem::path(BF_ROBOT_MODELS) / "iCub"};
        auto options = physics::SceneOptions::read(made->file, made->search_directories);
        for (const auto& robot : options.robots) made->sensors.push_back(robot.options.ft_sensors);
        made->scene = std::make_shared<const physics::Scene>(std::move(options));
        for (const auto& warning : made->scene->warnings()) bfWarning << warning;
        for (const auto& warning : made->scene->loop_warnings()) bfWarning << warning;
        return made;
    }
};

class WorldRobot final : public Block {
  public:
    using Block::Block;
    Argument<std::string> robot{this, "robot", {.doc = "its name in the world"}};
    Requires<SharedWorld> world{this, "the world in which the robot stands"};
    Provides<RobotDevice> device{this, [this]() -> std::shared_ptr<const RobotDevice> {
                                     return std::make_shared<WorldRobotDevice>(*world,
                                                                               world->scene->robot(*robot));
                                 }};
    Dim n{this, "n", [this]() -> Dim::Names {
              if (!world.is_bound()) return std::nullopt;
              return world->scene->joint_names(world->scene->robot(*robot));
          }};
    Output<Vector> s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "measured joint positions"}};
    Output<Vector> s_dot{
        this, "s_dot", {.shape = {n}, .unit = unit<"rad/s">, .doc = "measured joint velocities"}};
    Output<Vector> tau_measured{
        this,
        "tau_measured",
        {.shape = {n}, .unit = unit<"Nm">, .doc = "measured joint torques of the last interval"}};
    Output<Transform> w_H_b{this, "w_H_b", {.unit = mixed_units, .doc = "pose of the base in the world"}};
    Output<Vector6> v_b{this, "v_b", {.unit = mixed_units, .doc = base_velocity_doc}};
    Output<Vector3> com{this, "com", {.unit = unit<"m">, .doc = "centre of mass of the robot in the world"}};
    Scratch<int> number{this, [this] { return world->scene->robot(*robot); }};

    void start(Now at) const override {
        static_cast<SimulatedConnection&>(at[device]).bind(at[world].simulation);
    }
    Status output(Now at, Out out) const noexcept override {
        const auto& simulation = at[world].simulation;
        const int i = at[number];
        out[s] = simulation.s(i);
        out[s_dot] = simulation.s_dot(i);
        out[tau_measured] = simulation.tau(i);
        out[w_H_b] = simulation.w_H_b(i);
        out[v_b] = simulation.v_b(i);
        out[com] = simulation.com(i);
        return ok;
    }
};

class WorldObject final : public Block {
  public:
    using Block::Block;
    Argument<std::string> object{this, "object", {.doc = "its name in the world"}};
    Requires<SharedWorld> world{this, "the world in which the object is"};
    Scratch<int> number{this, [this] { return world->scene->object(*object); }};
    Output<Transform> w_H_o{this, "w_H_o", {.unit = mixed_units, .doc = "its pose in the world"}};
    Output<Vector6> v_o{
        this,
        "v_o",
        {.unit = mixed_units, .doc = "its velocity, mixed: origin [m/s], angular [rad/s], world axes"}};

    void infer(Inference&) const override {
        if (world.is_bound()) world->scene->object(*object);
    }
    Status output(Now at, Out out) const noexcept override {
        out[w_H_o] = at[world].simulation.w_H_o(at[number]);
        out[v_o] = at[world].simulation.v_o(at[number]);
        return ok;
    }
};

class WorldPush final : public Block {
  public:
    using Block::Block;
    Argument<std::string> robot{this, "robot", {.doc = "name of the robot in the world"}};
    Argument<std::string> link{this, "link", {.doc = "one of the push_links of the robot in the file"}};
    Requires<SharedWorld> world{this, "the world in which the robot stands"};
    Scratch<std::pair<int, int>> number{this, [this] { return find(); }};
    Input<Vector6> wrench{
        this,
        "wrench",
        {.unit = mixed_units,
         .doc =
             "force [N] and moment [Nm] on the link's centre of mass, world axes, held until the next one"}};

    void infer(Inference& inference) const override {
        if (!world.is_bound()) return;
        find();
        inference.claim({world->scene.get(), "the wrench on link '" + *link + "' of robot '" + *robot + "'"});
    }
    Status output(Now at, Out) const noexcept override {
        for (int i = 0; i < 6; ++i)
            if (!std::isfinite(at[wrench](i)))
                return Status::failure("{element} is not finite; look at what computes it", wrench, i);
        const auto [r, i] = at[number];
        at[world].simulation.set_wrench(r, i, at[wrench]);
        return ok;
    }

  private:
    std::pair<int, int> find() const {
        const int r = world->scene->robot(*robot);
        const auto& links = world->scene->options().robots[static_cast<std::size_t>(r)].options.push_links;
        const auto found = std::find(links.begin(), links.end(), *link);
        if (found == links.end())
            throw std::runtime_error("robot '" + *robot + "' has no link '" + *link +
                                     "' that may be pushed; name it in push_links of the robot in the "
                                     "world's file");
        return {r, static_cast<int>(found - links.begin())};
    }
};

class WorldActuator final : public Block {
  public:
    using Block::Block;
    Argument<std::string> robot{this, "robot", {.doc = "name of the robot in the world"}};
    Argument<std::string> actuator{this, "actuator", {.doc = "name of the actuator in the robot's MJCF"}};
    Requires<SharedWorld> world{this, "the world in which the robot stands"};
    Scratch<int> number{this, [this] { return find(); }};
    Input<double> u{
        this, "u", {.unit = any_unit, .doc = "control signal as the MJCF means it, held until the next one"}};

    void infer(Inference& inference) const override {
        if (!world.is_bound()) return;
        find();
        inference.claim({world->scene.get(), "actuator '" + *actuator + "' of robot '" + *robot + "'"});
    }
    Status output(Now at, Out) const noexcept override {
        if (!std::isfinite(at[u])) return Status::failure("u is not finite; look at what computes it");
        at[world].simulation.set_control(at[number], at[u]);
        return ok;
    }

  private:
    int find() const { return world->scene->actuator(world->scene->robot(*robot), *actuator); }
};

} // namespace

void SharedWorld::Live::restore(const double* from) {
    warn_of_another_world(simulation, from, "'" + file.string() + "'");
    simulation.restore(from);
}

void add_shared_world(Library& library) {
    library.group("world")
        .add<World>(
            "World",
            "A MuJoCo physics world with several robots and objects, which an XML file lists. It is a "
            "resource: WorldRobot, WorldObject and Configuration in its subsystem and below find theirs in "
            "it by name, and however many they are the world advances once per period of this block, after "
            "all have read and commanded. The period is a multiple of the time step in the file. Everything "
            "touches everything else; a part without mass is fixed. Source: E. Todorov, T. Erez, Y. Tassa, "
            "MuJoCo: a physics engine for model-based control, 2012. Errors: what the file says wrong, with "
            "its line; two parts of one name; a motion that diverges ends the run.")
        .add<WorldRobot>(
            "WorldRobot",
            "One robot of the World around it now: what its joints measure, with noise, delays, dropouts and "
            "ticks, as GetMeasurement reads it, and where base and centre of mass truly are. True joint "
            "positions are among `q` of the World. It is the robot that GetMeasurement, GetSensor, "
            "GetLimits, SetReferences, SetLowLevelPID and SetMotorParameters in its subsystem and below use; "
            "references are held until the next ones. Each robot of a world has a subsystem of its own. "
            "Errors: a name that the world does not have.")
        .add<WorldObject>("WorldObject", "Where an object of the World around it is, and how fast it moves, "
                                         "now. Errors: a name that the world does not have.")
        .add<WorldPush>("WorldPush",
                        "A wrench from outside on a link of a robot in the World around the block. Errors: a "
                        "robot that the world does not have, a link that the file does not list among "
                        "push_links; a wrench that is not finite ends the run.")
        .add<WorldActuator>(
            "WorldActuator",
            "Drives an actuator that the MJCF of a robot brings and that belongs to none of the controlled "
            "joints: the tendon of a gripper, a muscle. Errors: a name that the world or the robot does not "
            "have; a signal that is not finite ends the run.");
}

} // namespace bf::toolbox
