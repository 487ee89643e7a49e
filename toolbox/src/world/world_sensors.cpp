// Sensors in a world of several robots and objects.
#include "bf/core/block.hpp"
#include "bf/toolbox/shared_world.hpp"
#include "world/world.hpp"

#include <cmath>
#include <optional>
#include <stdexcept>

namespace bf::toolbox {

namespace {

constexpr const char* body_doc =
    "what the sensor is fixed to: an object, or ROBOT/LINK; none: the world, with its floor";
constexpr const char* pose_doc = "of the sensor in the body, 4 x 4";

class WorldRays final : public Block {
  public:
    using Block::Block;
    Argument<std::string> body{this, "body", {.doc = body_doc}};
    Argument<Matrix> pose{this, "pose", {.initial = Matrix::Identity(4, 4), .doc = pose_doc}};
    Argument<int> rays{this, "rays", {.initial = 181, .minimum = 1, .maximum = 100000, .doc = "how many"}};
    Argument<double> from{this,
                          "from",
                          {.initial = -1.5707963267948966,
                           .minimum = -100,
                           .maximum = 100,
                           .doc = "angle of the first ray about z from x, rad"}};
    Argument<double> to{this,
                        "to",
                        {.initial = 1.5707963267948966,
                         .minimum = -100,
                         .maximum = 100,
                         .doc = "angle of the last one, rad"}};
    Argument<double> range{
        this, "range", {.initial = 10, .above = 0, .maximum = 1e10, .doc = "farthest distance, m"}};
    Requires<SharedWorld> world{this, "the world in which the sensor is"};
    Dim n{this, "n", [this] { return *rays; }};
    struct Fan {
        physics::Frame frame;
        Eigen::Matrix3Xd directions;
    };
    Scratch<Fan> fan{this, [this] { return make(); }};
    Output<Vector> distance{this,
                            "distance",
                            {.shape = {n},
                             .unit = unit<"m">,
                             .doc = "to what each ray meets first; range where it meets nothing"}};

    void infer(Inference&) const override {
        if (world.is_bound()) make();
    }
    Status output(Now at, Out out) const noexcept override {
        const Fan& f = at[fan];
        at[world].simulation.measure_rays(f.frame, f.directions, *range, out[distance]);
        return ok;
    }

  private:
    Fan make() const {
        Fan f{world->scene->frame(*body, *pose), Eigen::Matrix3Xd(3, *rays)};
        for (int i = 0; i < *rays; ++i) {
            const double angle = *rays == 1 ? *from : *from + (*to - *from) * i / (*rays - 1);
            f.directions.col(i) << std::cos(angle), std::sin(angle), 0;
        }
        return f;
    }
};

class WorldContact final : public Block, public ContactSensor {
  public:
    using Block::Block;
    Argument<std::string> body{this, "body", {.doc = body_doc}};
    Argument<Matrix> pose{this, "pose", {.initial = Matrix::Identity(4, 4), .doc = pose_doc}};
    Argument<std::string> with{
        this,
        "with",
        {.doc = "the only thing whose contacts count: an object, ROBOT/LINK, or floor; none: all"}};
    Requires<SharedWorld> world{this, "the world in which the body is"};
    struct Pair {
        physics::Frame frame;
        std::optional<int> with;
    };
    Scratch<Pair> pair{this, [this] { return find(); }};
    Output<Vector6> wrench{this,
                           "wrench",
                           {.unit = mixed_units,
                            .doc = "all that touches the body exerts on it: force [N] and moment [Nm] at the "
                                   "sensor's origin, world axes, of the last time step"}};
    Output<bool> touches{this, "touches", {.doc = "does anything?"}};

    void infer(Inference&) const override {
        if (world.is_bound()) find();
    }
    void start(Now at) const override { at[world].simulation.remember_contacts(); }
    Status output(Now at, Out out) const noexcept override {
        const auto contact = at[world].simulation.contact(at[pair].frame, at[pair].with);
        out[wrench] = contact.wrench;
        out[touches] = contact.points > 0;
        return ok;
    }
    const physics::Scene& scene() const override { return *world->scene; }
    physics::Frame frame() const override { return scene().frame(*body, *pose); }

  private:
    Pair find() const {
        Pair found{frame(), {}};
        if (*with == "floor")
            found.with = -1;
        else if (!with->empty())
            found.with = scene().frame(*with).body;
        if (found.with == found.frame.body)
            throw std::runtime_error("argument 'with' names what the sensor is fixed to, which does not "
                                     "touch itself; name another one, or none for all that touches it");
        return found;
    }
};

class WorldTactile final : public Block {
  public:
    using Block::Block;
    Argument<std::string> body{this, "body", {.doc = body_doc}};
    Argument<Matrix> pose{
        this,
        "pose",
        {.initial = Matrix::Identity(4, 4),
         .doc = "of the middle of the patch in the body, 4 x 4: z out of the body, at what presses"}};
    Argument<std::vector<double>> size{
        this, "size", {.initial = {0.1, 0.1}, .above = 0, .doc = "of the patch along x and y, m"}};
    Argument<int> rows{this, "rows", {.initial = 8, .minimum = 1, .maximum = 1000, .doc = "cells along x"}};
    Argument<int> columns{
        this, "columns", {.initial = 8, .minimum = 1, .maximum = 1000, .doc = "cells along y"}};
    Argument<double> thickness{
        this,
        "thickness",
        {.initial = 0.005, .above = 0, .doc = "m, how far in front and behind contacts are felt"}};
    Requires<SharedWorld> world{this, "the world in which the body is"};
    Scratch<physics::Patch> patch{this, [this] { return make(); }};
    Output<Matrix> pressure{this,
                            "pressure",
                            {.shape = {Extent(*rows), Extent(*columns)},
                             .unit = unit<"Pa">,
                             .doc = "normal force per area, of the last time step"}};

    void infer(Inference&) const override {
        if (world.is_bound()) make();
    }
    void start(Now at) const override { at[world].simulation.remember_contacts(); }
    Status output(Now at, Out out) const noexcept override {
        at[world].simulation.pressures(at[patch], out[pressure]);
        return ok;
    }

  private:
    physics::Patch make() const {
        if (size->size() != 2)
            throw std::runtime_error("argument 'size' has " + std::to_string(size->size()) +
                                     " elements; give the lengths along x and y");
        return {world->scene->frame(*body, *pose), {(*size)[0], (*size)[1]}, *thickness};
    }
};

} // namespace

void add_world_sensors(Library& library) {
    library.group("world")
        .add<WorldRays>("WorldRays",
                        "A fan of rays, such as a lidar has: distances to what they meet, now, in the x-y "
                        "plane of a frame that is fixed to a body of the World around the block. What is "
                        "seen are the shapes that touch; those of the body itself are not. Errors: a body "
                        "that the world does not have, a pose that is none.")
        .add<WorldContact>("WorldContact",
                           "What touches a body of the World around the block, and with which wrench, as a "
                           "sole or a finger feels it. Errors: a body that the world does not have, a pose "
                           "that is none; more than 256 contacts at a time in the world end the run.")
        .add<WorldTactile>(
            "WorldTactile",
            "A rectangle of tactile cells on the face of a body in the World around the block. The normal "
            "force of each point of contact within goes to the four cells around it, by their distances, so "
            "that the sum of pressures times the area of a cell is the force that presses, and the centre of "
            "pressure is kept but for half a cell at the borders. Bodies touch in points: a box that lies "
            "flat is felt at its corners. Errors: a body that the world does not have, a pose that is none; "
            "more than 256 contacts at a time in the world end the run.");
}

} // namespace bf::toolbox
