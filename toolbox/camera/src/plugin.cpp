// Cameras in a world of several robots and objects.
#include "bf/core/block.hpp"
#include "bf/core/registry.hpp"
#include "bf/physics/camera.hpp"
#include "bf/toolbox/shared_world.hpp"

#include <cstdint>
#include <memory>

namespace bf::toolbox {

namespace {

class WorldCamera final : public Block {
  public:
    using Block::Block;
    Requires<SharedWorld> world{this, "the world in which the camera is"};
    Argument<std::string> body{
        this, "body", {.doc = "what the camera is fixed to: an object or ROBOT/LINK; none: the world"}};
    Argument<Matrix> pose{
        this,
        "pose",
        {.initial = Matrix::Identity(4, 4),
         .doc = "of the camera in the body, 4 x 4: x to the right of the picture, y down, z ahead"}};
    Argument<int> width{this,
                        "width",
                        {.initial = 320,
                         .minimum = 1,
                         .maximum = 8192,
                         .doc = "pixels in a row; with height at most 9e6 in all"}};
    Argument<int> height{this, "height", {.initial = 240, .minimum = 1, .maximum = 8192, .doc = "rows"}};
    Argument<double> field_of_view{
        this, "field_of_view", {.initial = 0.8, .above = 0, .maximum = 2.9, .doc = "vertical, rad"}};
    Argument<bool> with_colour{this, "with_colour", {.initial = true, .doc = "give colours"}};
    Argument<bool> with_depth{this, "with_depth", {.initial = false, .doc = "give depths"}};
    Argument<bool> with_segmentation{this, "with_segmentation", {.initial = false, .doc = "give bodies"}};
    Argument<double> range{
        this,
        "range",
        {.initial = 10, .above = 0, .maximum = 1e10, .doc = "farthest depth, m; what is behind has it"}};
    Argument<std::vector<double>> depth_noise{
        this,
        "depth_noise",
        {.initial = {0, 0},
         .minimum = 0,
         .doc = "a b: the standard deviation of a depth z is a + b z^2, in m and 1/m"}};
    Argument<int> seed{this,
                       "seed",
                       {.minimum = 0,
                        .doc = "of the noise; without one the block's path in the model decides",
                        .from_path = true}};

    Output<Array<std::uint8_t>> colour{this,
                                       "colour",
                                       {.shape = {Extent(*height), Extent(3 * *width)},
                                        .doc = "red, green and blue, from 0 to 255, beside each other: in "
                                               "memory, column by column, height x width x 3",
                                        .present = *with_colour}};
    Output<Matrix> depth{this,
                         "depth",
                         {.shape = {Extent(*height), Extent(*width)},
                          .unit = unit<"m">,
                          .doc = "along the axis of the camera, to what is nearest",
                          .present = *with_depth}};
    Output<Array<std::int32_t>> segmentation{
        this,
        "segmentation",
        {.shape = {Extent(*height), Extent(*width)},
         .doc = "number of the body that is seen, as the world counts them from 1; 0: the floor; -1: nothing",
         .present = *with_segmentation}};
    DiscreteState<double> pictures{this, "pictures", {.doc = "how many were made", .present = *with_depth}};
    struct View {
        physics::Frame frame;
        physics::Camera camera;
    };
    Scratch<std::shared_ptr<View>> view{
        this, [this] {
            return std::shared_ptr<View>(new View{frame(), physics::Camera(*world->scene, options())});
        }};

    void infer(Inference&) const override {
        if (!world.is_bound()) return;
        frame();
        options().validate();
    }
    Status output(Now at, Out out) const noexcept override {
        auto& [frame, camera] = *at[view];
        const auto& simulation = at[world].simulation;
        const auto q = simulation.q();
        if (!camera.look({q.data(), static_cast<std::size_t>(q.size())}, simulation.w_H(frame)))
            return Status::failure("OpenGL draws no picture; look at what else of the program uses OSMesa");
        if (colour.is_present()) camera.colour(out[colour]);
        if (depth.is_present()) camera.depth(out[depth], static_cast<std::uint64_t>(at[pictures]));
        if (segmentation.is_present()) camera.segmentation(out[segmentation]);
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        if (pictures.is_present()) next[pictures] = at[pictures] + 1;
        return ok;
    }

  private:
    physics::Frame frame() const { return world->scene->frame(*body, *pose); }
    physics::CameraOptions options() const {
        if (!with_colour && !with_depth && !with_segmentation)
            throw std::runtime_error("the camera gives nothing; let with_colour, with_depth or "
                                     "with_segmentation be true");
        if (depth_noise->size() != 2)
            throw std::runtime_error("argument 'depth_noise' has " + std::to_string(depth_noise->size()) +
                                     " elements; give a and b of a + b z^2");
        return {*width,
                *height,
                *field_of_view,
                *range,
                {(*depth_noise)[0], (*depth_noise)[1]},
                static_cast<std::uint64_t>(*seed),
                *with_colour,
                *with_depth,
                *with_segmentation};
    }
};

} // namespace

} // namespace bf::toolbox

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("world").add<bf::toolbox::WorldCamera>(
        "WorldCamera",
        "A camera in the World around the block: pictures of what is there now, drawn off-screen, once per "
        "period of the block, which may be longer than the world's. Its frame is fixed to a body or to the "
        "world. Depths may have seeded noise. Source of the noise: C. V. Nguyen, S. Izadi, D. Lovell, "
        "Modeling Kinect sensor noise for improved 3D reconstruction and tracking, 2012. Errors: a body that "
        "the world does not have, a pose that is none, meshes that are not found; a computer without "
        "OpenGL.");
}
