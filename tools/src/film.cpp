// bf film: a recording of a physics world as a film.
#include "bf/physics/figure.hpp"
#include "bf/physics/renderer.hpp"
#include "bf/recording/reader.hpp"
#include "files.hpp"
#include "robots.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <optional>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct FilmOptions {
    ModelOptions model;
    std::string recording, output, picture;
    double frames_per_second = 25, speed = 1, from = 0, to = std::numeric_limits<double>::infinity();
    std::optional<double> picture_time; // none: the end
    physics::RenderOptions picture_options{.width = 640, .height = 640};
};

/// The world in the diagram, and the name its signals begin with.
struct FilmedRobot {
    const physics::World* world = nullptr;
    std::string path;
};

FilmedRobot find_robot(const Diagram& diagram) {
    const auto worlds = worlds_of(diagram);
    if (worlds.empty())
        throw CommandError(diagram.name + " has no MujocoWorld block: there is nothing to film");
    return {worlds.back().second, worlds.back().first};
}

/// Last sample not after t.
std::size_t sample_at(const recording::Channel& channel, double t) {
    const auto ns = static_cast<std::int64_t>(t * 1e9 + 0.5);
    const auto after = std::upper_bound(channel.time_ns.begin(), channel.time_ns.end(), ns);
    return after == channel.time_ns.begin() ? 0
                                            : static_cast<std::size_t>(after - channel.time_ns.begin()) - 1;
}

Vector values(const recording::Channel& channel, double t) {
    const std::size_t k = sample_at(channel, t);
    Vector v(static_cast<Eigen::Index>(channel.info.elements()));
    for (Eigen::Index i = 0; i < v.size(); ++i) v(i) = channel.value(k, static_cast<std::size_t>(i));
    return v;
}

class Film {
  public:
    Film(const FilmOptions& options, const FilmedRobot& robot)
        : options_(options), recording_(load_recording(options.recording)), path_(robot.path),
          renderer_(*robot.world, options.picture_options), base_(recording_.channel(path_ + ".w_H_b")),
          joints_(robot.world->joint_count() > 0 ? &recording_.channel(path_ + ".s") : nullptr) {
        if (base_.samples() == 0)
            throw CommandError(options.recording + " holds no sample of " + path_ + ".w_H_b");
    }

    const recording::Recording& recording() const { return recording_; }
    double end() const { return std::min(options_.to, base_.time(base_.samples() - 1)); }

    void draw(double t, physics::Image& image) {
        const Vector H = values(base_, t), s = joints_ ? values(*joints_, t) : Vector();
        std::vector<physics::Arrow> arrows;
        for (const auto& channel : recording_.channels) {
            if (channel.samples() == 0) continue;
            if (channel.name.starts_with(path_ + ".wrench_")) add_contact(channel, t, arrows);
            if (channel.name.find("push") != std::string::npos && channel.info.elements() == 6)
                add_push(channel, t, H, arrows);
        }
        renderer_.render(Eigen::Map<const Eigen::Matrix4d>(H.data()),
                         {s.data(), static_cast<std::size_t>(s.size())}, arrows, image);
    }

  private:
    void add_contact(const recording::Channel& wrench, double t, std::vector<physics::Arrow>& arrows) {
        const std::string foot = wrench.name.substr((path_ + ".wrench_").size());
        const auto pose = std::find_if(recording_.channels.begin(), recording_.channels.end(),
                                       [&](const auto& c) { return c.name == path_ + ".pose_" + foot; });
        if (pose == recording_.channels.end()) return;
        const Vector f = values(wrench, t), H = values(*pose, t);
        if (const auto contact = physics::contact_force(Eigen::Map<const Eigen::Matrix4d>(H.data()), f))
            arrows.push_back({contact->origin, contact->force * renderer_.options().metres_per_newton,
                              physics::Arrow::Kind::contact});
    }

    void add_push(const recording::Channel& push, double t, const Vector& H,
                  std::vector<physics::Arrow>& arrows) {
        const Vector f = values(push, t);
        if (f.head<3>().norm() < 1) return;
        const Eigen::Map<const Eigen::Matrix4d> w_H_b(H.data());
        const Eigen::Vector3d vector = f.head<3>() * 4 * renderer_.options().metres_per_newton;
        // The arrow ends at the chest, some 20 cm above the base.
        arrows.push_back({w_H_b.topRightCorner<3, 1>() + Eigen::Vector3d(0, 0, 0.2) - vector, vector,
                          physics::Arrow::Kind::push});
    }

    const FilmOptions& options_;
    recording::Recording recording_;
    std::string path_;
    physics::Renderer renderer_;
    const recording::Channel& base_;
    const recording::Channel* joints_; ///< none when the robot has no joints
};

void refuse_after_end(const Film& film, const std::string& option, double t) {
    if (t > film.end())
        throw CommandError(option + " " + number(t) + " is after the end at " + number(film.end()) + " s");
}

void refuse_other_format(const std::string& option, const std::string& file, const std::string& ending) {
    if (!file.empty() && fs::path(file).extension() != ending)
        throw CommandError(option + " " + file + ": the name of this file ends in " + ending);
}

void draw_picture(Film& film, const FilmOptions& options) {
    physics::Image image;
    const double t = options.picture_time.value_or(film.end());
    refuse_after_end(film, "--at", t);
    film.draw(t, image);
    OutputFile file(options.picture);
    physics::write_png(file.path(), image);
    file.commit();
    std::printf("%s\n", options.picture.c_str());
}

void draw_film(Film& film, const FilmOptions& options) {
    refuse_after_end(film, "--from", options.from);
    OutputFile file(options.output);
    const InterruptGuard guard;
    physics::VideoWriter video(file.path(), options.picture_options.width, options.picture_options.height,
                               options.frames_per_second);
    const double step = options.speed / options.frames_per_second;
    const int frames = static_cast<int>((film.end() - options.from) / step) + 1;
    physics::Image image;
    StatusLine line;
    const auto text = [&](int done) {
        return "  frame " + std::to_string(done) + " of " + std::to_string(frames);
    };
    for (int i = 0; i < frames; ++i) {
        film.draw(options.from + i * step, image);
        if (!InterruptGuard::signal()) video.add(image);
        if (const int signal = InterruptGuard::signal()) {
            line.finish(text(i));
            throw Interrupted(signal, "interrupted: " + options.output + " was not written");
        }
        line.show(text(i + 1));
    }
    video.close();
    file.commit();
    line.finish(text(frames));
    std::printf("%s\n", options.output.c_str());
}

void execute(const FilmOptions& options) {
    if (options.picture.empty() && options.output.empty())
        throw CommandError("say what to make: -o FILE.mp4 for a film, --picture FILE.png for one picture");
    refuse_other_format("-o", options.output, ".mp4");
    refuse_other_format("--picture", options.picture, ".png");
    const LoadedModel loaded = load_model(options.model);
    FileSet read = files_of(loaded);
    read.insert(options.recording);
    read.insert(options.model.params.begin(), options.model.params.end());
    refuse_overwriting({{"-o", options.output}, {"--picture", options.picture}}, read);
    Film film(options, find_robot(loaded.diagram));
    if (!options.picture.empty()) draw_picture(film, options);
    if (!options.output.empty()) draw_film(film, options);
    refuse_incomplete(film.recording(), options.recording,
                      options.output.empty() ? options.picture : options.output);
}

} // namespace

void add_film(CLI::App& app) {
    auto* command = app.add_subcommand("film", "render a recording of a physics world");
    auto options = std::make_shared<FilmOptions>();
    options->model.add_to(*command);
    const auto number_option = [&](const char* name, auto& value, const char* doc, const char* unit) {
        return command->add_option(name, value, doc)->type_name(unit);
    };
    command->add_option("RECORDING", options->recording, "MCAP file that bf run wrote from the model")
        ->required()
        ->type_name("");
    command->add_option("-o,--output", options->output, "MP4 film")->type_name("FILE");
    command->add_option("--picture", options->picture, "PNG picture of one moment")->type_name("FILE");
    number_option("--at", options->picture_time, "time of the picture; otherwise the end", "T")
        ->check(between(0.0, 1e9));
    number_option("--from", options->from, "where the film begins, s", "T")->check(between(0.0, 1e9));
    number_option("--to", options->to, "where the film ends, s", "T")->check(between(0.0, 1e9));
    number_option("--fps", options->frames_per_second, "frames per second", "N")
        ->check(between(1.0, 1000.0))
        ->capture_default_str();
    number_option("--speed", options->speed, "2 plays twice as fast", "FACTOR")
        ->check(between(1e-3, 1e3))
        ->capture_default_str();
    auto& picture = options->picture_options;
    number_option("--distance", picture.distance, "of the camera from the point it looks at, m", "M")
        ->check(between(1e-3, 1e6))
        ->capture_default_str();
    number_option("--azimuth", picture.azimuth,
                  "direction of view about z, deg: 0 along x, 180 facing the robot", "DEG")
        ->capture_default_str();
    number_option("--elevation", picture.elevation, "deg; below 0 the camera looks down", "DEG")
        ->check(between(-90.0, 90.0))
        ->capture_default_str();
    number_option("--look-at", picture.look_at_height, "height of the point looked at, m", "M")
        ->capture_default_str();
    command->add_flag_callback(
        "--no-follow", [&picture] { picture.follows = false; },
        "the camera stays where it is when the base moves");
    number_option("--width", picture.width, "pixels", "N")->check(between(16, 8192))->capture_default_str();
    number_option("--height", picture.height, "pixels", "N")->check(between(16, 8192))->capture_default_str();
    command->footer("The model's MujocoWorld block is shown; its w_H_b and s must be recorded.\n"
                    "Examples:\n"
                    "  bf film examples/icub_balancing/balancing.yaml run.mcap -o film.mp4\n"
                    "  bf film examples/icub_balancing/balancing.yaml run.mcap --picture end.png");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
