// Pictures of cameras as messages: images, depths and clouds of points.
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/topics.hpp"
#include "blocks.hpp"
#include "messages.hpp"
#include "names.hpp"
#include "types.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <rosidl_runtime_c/primitives_sequence_functions.h>
#include <sensor_msgs/msg/camera_info.h>
#include <sensor_msgs/msg/image.h>
#include <sensor_msgs/msg/point_cloud2.h>
#include <sensor_msgs/msg/point_field.h>

namespace bf::ros2 {

namespace {

using middleware::Opened;

using CameraInfo = sensor_msgs__msg__CameraInfo;
using Cloud = sensor_msgs__msg__PointCloud2;
using Image = sensor_msgs__msg__Image;

/// A pinhole camera without distortion, whose pixels have their middles at whole numbers.
struct Pinhole {
    int width, height;
    double field_of_view; ///< vertical, rad
    double f() const { return height / (2 * std::tan(field_of_view / 2)); }
    double cx() const { return (width - 1) / 2.0; }
    double cy() const { return (height - 1) / 2.0; }
    std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

struct CameraOptions {
    Pinhole lens;
    double range; ///< m
    std::string topic, frame;
    bool has_colour, has_depth, has_points, is_model_time;
};

std::uint8_t* resize(rosidl_runtime_c__uint8__Sequence& data, std::size_t size) {
    if (data.size != size) {
        rosidl_runtime_c__uint8__Sequence__fini(&data);
        if (!rosidl_runtime_c__uint8__Sequence__init(&data, size)) throw std::bad_alloc();
    }
    return data.data;
}

/// The step leaves pictures as the blocks have them, column by column and each colour by itself; the node's
/// thread makes messages of them.
class Pictures final : public Sender {
  public:
    Pictures(const Node& node, const CameraOptions& options)
        : newest(1 + options_size(options)), options_(options), context_(node.context()),
          values_(static_cast<std::size_t>(newest.size())) {
        const auto& [width, height, field_of_view] = options.lens;
        const auto advertise = [&](const MessageMemory& type, const char* its) {
            return node.advertise(type, options.topic + its, {1, true});
        };
        info_end_ = advertise(messages::camera_info(), "/camera_info");
        messages::assign(info_->header.frame_id, options.frame);
        info_->width = static_cast<std::uint32_t>(width);
        info_->height = static_cast<std::uint32_t>(height);
        messages::assign(info_->distortion_model, "plumb_bob");
        messages::resize(info_->d, 5);
        std::fill_n(info_->d.data, 5, 0.0);
        const double f = options.lens.f(), cx = options.lens.cx(), cy = options.lens.cy();
        std::ranges::copy(std::array{f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0}, info_->k);
        std::ranges::copy(std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}, info_->r);
        std::ranges::copy(std::array{f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0}, info_->p);
        const auto prepare = [&](Image& image, const char* encoding, std::size_t bytes) {
            messages::assign(image.header.frame_id, options.frame);
            image.width = info_->width;
            image.height = info_->height;
            messages::assign(image.encoding, encoding);
            image.step = static_cast<std::uint32_t>(bytes) * image.width;
            std::fill_n(resize(image.data, bytes * options.lens.pixels()), image.data.size, 0);
        };
        if (options.has_colour) {
            image_end_ = advertise(messages::image(), "/image_raw");
            prepare(*image_, "rgb8", 3);
        }
        if (options.has_depth) {
            depth_end_ = advertise(messages::image(), "/depth/image_raw");
            prepare(*depth_, "32FC1", sizeof(float));
        }
        if (options.has_points) {
            cloud_end_ = advertise(messages::point_cloud(), "/points");
            messages::assign(cloud_->header.frame_id, options.frame);
            cloud_->width = info_->width;
            cloud_->height = info_->height;
            const std::size_t fields = options.has_colour ? 4 : 3;
            if (!sensor_msgs__msg__PointField__Sequence__init(&cloud_->fields, fields))
                throw std::bad_alloc();
            const char* const names[] = {"x", "y", "z", "rgb"};
            for (std::size_t i = 0; i < fields; ++i) {
                auto& field = cloud_->fields.data[i];
                messages::assign(field.name, names[i]);
                field.offset = static_cast<std::uint32_t>(i * sizeof(float));
                field.datatype = sensor_msgs__msg__PointField__FLOAT32;
                field.count = 1;
            }
            cloud_->point_step = static_cast<std::uint32_t>(fields * sizeof(float));
            cloud_->row_step = cloud_->point_step * cloud_->width;
            cloud_->is_dense = false; // what is too far is none
            resize(cloud_->data, cloud_->row_step * cloud_->height);
        }
    }

    /// How many numbers colours take, eight bytes each.
    static std::size_t colour_size(const CameraOptions& options) {
        return options.has_colour ? (3 * options.lens.pixels() + sizeof(double) - 1) / sizeof(double) : 0;
    }

    bool has_news() const noexcept override { return newest.newest() != sent_; }
    void send() override {
        middleware::Stamp stamp;
        if (!newest.read(values_.data(), stamp)) return;
        sent_ = stamp.number;
        const auto time = messages::time_of(options_.is_model_time ? values_[0] : context_->now());
        const std::size_t colours = colour_size(options_), pixels = options_.lens.pixels();
        rgb_.resize(colours * sizeof(double));
        std::memcpy(rgb_.data(), values_.data() + 1, rgb_.size());
        const double* depths = values_.data() + 1 + colours;
        const auto rows = static_cast<std::size_t>(options_.lens.height);
        /// Calls f(pixel as messages count, pixel as blocks do, u, v).
        const auto each = [&](auto&& f) {
            for (std::size_t v = 0, to = 0; v < rows; ++v)
                for (std::size_t u = 0; u < pixels / rows; ++u, ++to) f(to, v + rows * u, u, v);
        };
        // Pictures are large: who has no reader is not made.
        if (image_end_ && image_end_->readers() > 0) {
            each([&](std::size_t to, std::size_t from, std::size_t, std::size_t) {
                for (std::size_t c = 0; c < 3; ++c) image_->data.data[3 * to + c] = rgb_[from + pixels * c];
            });
            image_->header.stamp = time;
            image_end_->publish(image_.get());
        }
        const auto is_far = [&](std::size_t from) { return depths[from] >= options_.range; };
        if (depth_end_ && depth_end_->readers() > 0) {
            each([&](std::size_t to, std::size_t from, std::size_t, std::size_t) {
                const float z = is_far(from) ? std::numeric_limits<float>::infinity() // as REP 118 has it
                                             : static_cast<float>(depths[from]);
                std::memcpy(depth_->data.data + to * sizeof z, &z, sizeof z);
            });
            depth_->header.stamp = time;
            depth_end_->publish(depth_.get());
        }
        if (cloud_end_ && cloud_end_->readers() > 0) {
            const double f = options_.lens.f(), cx = options_.lens.cx(), cy = options_.lens.cy();
            each([&](std::size_t to, std::size_t from, std::size_t u, std::size_t v) {
                const double z = is_far(from) ? std::nan("") : depths[from];
                const float xyz[] = {static_cast<float>((static_cast<double>(u) - cx) * z / f),
                                     static_cast<float>((static_cast<double>(v) - cy) * z / f),
                                     static_cast<float>(z)};
                std::uint8_t* at = cloud_->data.data + to * cloud_->point_step;
                std::memcpy(at, xyz, sizeof xyz);
                if (colours == 0) return;
                const std::uint32_t rgb = std::uint32_t{rgb_[from]} << 16 |
                                          std::uint32_t{rgb_[from + pixels]} << 8 | rgb_[from + 2 * pixels];
                std::memcpy(at + sizeof xyz, &rgb, sizeof rgb);
            });
            cloud_->header.stamp = time;
            cloud_end_->publish(cloud_.get());
        }
        info_->header.stamp = time;
        info_end_->publish(info_.get());
    }

    middleware::ExchangeBuffer newest; ///< time of the model, colours, depths

  private:
    static int options_size(const CameraOptions& options) {
        return static_cast<int>(colour_size(options) + (options.has_depth ? options.lens.pixels() : 0));
    }
    const CameraOptions options_;
    std::shared_ptr<Context> context_;
    std::vector<double> values_;
    std::vector<std::uint8_t> rgb_;
    std::atomic<std::uint64_t> sent_{0};
    std::shared_ptr<Publisher> info_end_, image_end_, depth_end_, cloud_end_; ///< null: there is none
    std::shared_ptr<CameraInfo> info_ = messages::make<CameraInfo>(messages::camera_info());
    std::shared_ptr<Image> image_ = messages::make<Image>(messages::image()),
                           depth_ = messages::make<Image>(messages::image());
    std::shared_ptr<Cloud> cloud_ = messages::make<Cloud>(messages::point_cloud());
};

class PublishCamera final : public Block {
  public:
    explicit PublishCamera(const Arguments& arguments) : Block(arguments) {
        std::vector<std::string> problems;
        middleware::check_name(name_rules.topic, "topic", topic, problems);
        for (auto& text : problems) problem(std::move(text));
        if (!with_colour && !with_depth)
            problem("the camera shows nothing; let with_colour or with_depth be true");
    }
    Argument<std::string> topic{
        this,
        "topic",
        {.initial = "camera", .doc = "before its topics, absolute or in the node's namespace"}};
    Argument<std::string> frame_id{
        this,
        "frame_id",
        {.doc = "of the headers: the camera's, x to the right of the picture, y down, z ahead"}};
    Argument<int> width{
        this, "width", {.initial = 320, .minimum = 1, .maximum = 8192, .doc = "pixels in a row"}};
    Argument<int> height{this, "height", {.initial = 240, .minimum = 1, .maximum = 8192, .doc = "rows"}};
    Argument<double> field_of_view{
        this, "field_of_view", {.initial = 0.8, .above = 0, .maximum = 2.9, .doc = "vertical, rad"}};
    Argument<double> range{
        this,
        "range",
        {.initial = 10, .above = 0, .maximum = 1e10, .doc = "depths from here on are none, m"}};
    Argument<bool> with_colour{this, "with_colour", {.initial = true, .doc = "publish TOPIC/image_raw"}};
    Argument<bool> with_depth{
        this, "with_depth", {.initial = false, .doc = "publish TOPIC/depth/image_raw and TOPIC/points"}};
    Argument<std::string> stamp{
        this,
        "stamp",
        {.initial = "clock",
         .doc = "of the headers: time of ROS when they are sent, or time of the model",
         .choices = {"clock", "model"}}};
    Requires<RosNode> node{this, "the node that talks"};
    Input<Array<std::uint8_t>> colour{
        this,
        "colour",
        {.shape = {Extent(*height), Extent(3 * *width)},
         .doc = "red, green and blue, from 0 to 255, beside each other, as WorldCamera gives them",
         .present = *with_colour}};
    Input<Matrix> depth{this,
                        "depth",
                        {.shape = {Extent(*height), Extent(*width)},
                         .unit = unit<"m">,
                         .doc = "along the axis of the camera",
                         .present = *with_depth}};
    OutsideState<Opened<Pictures>> opened{this, [] { return std::make_shared<Opened<Pictures>>(); }};
    Scratch<std::vector<double>> values{this, [] { return std::vector<double>(); }};

    void start(Now at) const override {
        Node& its = at[node];
        its.open();
        auto end = std::make_shared<Pictures>(its, options());
        its.add(end);
        at[values].assign(static_cast<std::size_t>(end->newest.size()), 0.0);
        at[opened].end = std::move(end);
    }
    void stop(Now at) const noexcept override {
        send_last(at[opened].end);
        at[opened].end.reset();
    }
    Status output(Now at, Out) const noexcept override {
        auto& all = at[values];
        all[0] = at.time();
        const auto options_ = options_of_sizes();
        if (colour.is_present()) std::memcpy(all.data() + 1, at[colour].data(), 3 * options_.lens.pixels());
        if (depth.is_present())
            std::copy_n(at[depth].data(), options_.lens.pixels(),
                        all.data() + 1 + Pictures::colour_size(options_));
        at[opened].end->newest.write(all.data(), middleware::now());
        at[node].bell().ring();
        return ok;
    }

  private:
    CameraOptions options() const {
        auto options = options_of_sizes();
        options.topic = topic;
        options.frame = frame_id;
        return options;
    }
    /// Without texts, as steps have them.
    CameraOptions options_of_sizes() const noexcept {
        return {.lens = {width, height, field_of_view},
                .range = range,
                .topic = {},
                .frame = {},
                .has_colour = with_colour,
                .has_depth = with_depth,
                .has_points = with_depth,
                .is_model_time = *stamp == "model"};
    }
};

} // namespace

void add_cameras(Library& library) {
    library.group("topics").add<PublishCamera>(
        "PublishCamera",
        "Publishes pictures of a camera, such as those of WorldCamera: TOPIC/image_raw "
        "(sensor_msgs/msg/Image, rgb8), TOPIC/depth/image_raw (32FC1, m; infinite where nothing is in "
        "range) and TOPIC/points (sensor_msgs/msg/PointCloud2: x, y, z in the camera's frame and rgb where "
        "there are colours, height x width, NaN where nothing is in range), beside TOPIC/camera_info "
        "(sensor_msgs/msg/CameraInfo) of a pinhole camera without distortion: f = height / (2 "
        "tan(field_of_view / 2)), x = (u - cx) z / f with cx = (width - 1) / 2, and so y. The node's thread "
        "makes the messages, of what has readers, the newest where several pictures are left; so give this "
        "block the camera's period. Sources: REP 103 and REP 118. Errors: no picture, a name of a topic "
        "that ROS 2 does not allow.");
}

} // namespace bf::ros2
