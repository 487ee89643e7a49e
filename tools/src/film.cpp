// bf film: recordings of physics worlds as a film.
#include "bf/physics/figure.hpp"
#include "bf/physics/renderer.hpp"
#include "bf/recording/reader.hpp"
#include "bf/run/replay.hpp"
#include "bf/toolbox/shared_world.hpp"
#include "files.hpp"
#include "robots.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <list>
#include <optional>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct FilmOptions {
    std::vector<std::string> recordings, trails;
    std::string output, picture;
    double frames_per_second = 25, speed = 1, from = 0, to = std::numeric_limits<double>::infinity();
    std::optional<double> picture_time; // none: the end
    bool shows_com = false, shows_support = false;
    physics::RenderOptions picture_options{.width = 0, .height = 640};
};

constexpr double trail_period = 0.02; ///< s, between points of a trail
constexpr std::size_t longest = 3000; ///< points of a trail
constexpr int width_of_one = 640;     ///< pixels, of a recording's picture where none is asked for

Vector values(const recording::Channel& channel, double t) {
    const std::size_t k = channel.sample_at(t);
    Vector v(static_cast<Eigen::Index>(channel.info.elements()));
    for (Eigen::Index i = 0; i < v.size(); ++i) v(i) = channel.value(k, static_cast<std::size_t>(i));
    return v;
}

/// A recording with the world that its model had.
class Take {
  public:
    Take(const std::string& file, const FilmOptions& options, int width)
        : file_(file), options_(options), recording_(load_recording(file)),
          loaded_(load_model(recorded_source(recording_))) {
        physics::RenderOptions picture = options.picture_options;
        picture.width = width;
        if (const auto worlds = worlds_of(loaded_.diagram); !worlds.empty()) {
            const auto& [path, world] = worlds.back();
            path_ = path;
            scene_ = world->scene().get();
            base_ = &samples_of("w_H_b", 16);
            if (world->joint_count() > 0)
                positions_ = &samples_of("s", static_cast<std::size_t>(world->joint_count()));
            renderer_.emplace(*world, picture);
        } else if (const auto shared = shared_worlds_of(loaded_.diagram); !shared.empty()) {
            const auto& [path, scene] = shared.back();
            path_ = path;
            scene_ = scene;
            positions_ = &samples_of("q", static_cast<std::size_t>(scene->position_count()));
            renderer_.emplace(*scene, picture);
            for (const auto& [block, sensor] : contact_sensors_of(loaded_.diagram, *scene)) {
                const auto wrench =
                    std::ranges::find(recording_.channels, block + ".wrench", &recording::Channel::name);
                if (wrench != recording_.channels.end() && wrench->samples() > 0)
                    sensors_.emplace_back(sensor->frame(), &*wrench);
            }
        } else {
            throw CommandError(loaded_.diagram.name +
                               " has no MujocoWorld or World block: there is nothing to film");
        }
    }

    const recording::Recording& recording() const { return recording_; }
    const std::string& file() const { return file_; }
    FileSet files() const { return files_of(loaded_); }
    double end() const {
        const auto& channel = base_ ? *base_ : *positions_;
        return std::min(options_.to, channel.time(channel.samples() - 1));
    }

    /// Trails begin there.
    void begin(double t) {
        trails_.clear();
        bodies_.clear();
        for (const auto& name : options_.trails) {
            bodies_.push_back(scene_->frame(name));
            physics::Line& line = trails_.emplace_back();
            line.number = static_cast<int>(trails_.size()) - 1;
        }
        trailed_ = t;
    }

    void draw(double t, const std::string& caption, physics::Image& image) {
        t = std::min(t, end());
        const double step = std::max(trail_period, (end() - options_.from) / static_cast<double>(longest));
        for (; !bodies_.empty() && trailed_ < t; trailed_ += step) follow(trailed_);
        place(t);
        physics::Marks marks{.lines = trails_, .caption = caption};
        for (std::size_t i = 0; i < bodies_.size(); ++i)
            marks.lines[i].points.push_back(renderer_->position(bodies_[i]));
        for (int robot = 0; robot < renderer_->robot_count(); ++robot) {
            if (options_.shows_com) marks.centres.push_back(renderer_->com(robot));
            if (!options_.shows_support) continue;
            physics::Line outline{.points = renderer_->support(robot), .kind = physics::Line::Kind::outline};
            if (!outline.points.empty()) outline.points.push_back(outline.points.front());
            marks.lines.push_back(std::move(outline));
        }
        for (const auto& [frame, wrench] : sensors_)
            add(physics::axial_force(renderer_->position(frame), values(*wrench, t)), marks.arrows);
        for (const auto& channel : recording_.channels) {
            if (channel.samples() == 0) continue;
            if (channel.name.starts_with(path_ + ".wrench_")) add_contact(channel, t, marks.arrows);
            if (base_ && channel.name.find("push") != std::string::npos && channel.info.elements() == 6)
                add_push(channel, t, marks.arrows);
        }
        renderer_->draw(marks, image);
    }

  private:
    const recording::Channel& samples_of(const std::string& name, std::size_t elements) {
        const auto& channel = recording_.channel(path_ + "." + name);
        if (channel.samples() == 0) throw CommandError(file_ + " holds no sample of " + path_ + "." + name);
        if (channel.info.elements() != elements)
            throw CommandError(file_ + ": " + channel.name + " has " +
                               std::to_string(channel.info.elements()) + " elements, but the world has " +
                               std::to_string(elements) + " positions now; its files were changed");
        return channel;
    }

    void place(double t) {
        const Vector now = positions_ ? values(*positions_, t) : Vector();
        const std::span<const double> positions(now.data(), static_cast<std::size_t>(now.size()));
        if (base_)
            renderer_->place(Eigen::Map<const Eigen::Matrix4d>(values(*base_, t).data()), positions);
        else
            renderer_->place(positions);
    }

    void follow(double t) {
        place(t);
        for (std::size_t i = 0; i < bodies_.size(); ++i)
            trails_[i].points.push_back(renderer_->position(bodies_[i]));
    }

    void add_contact(const recording::Channel& wrench, double t, std::vector<physics::Arrow>& arrows) {
        const std::string foot = wrench.name.substr((path_ + ".wrench_").size());
        const auto pose = std::find_if(recording_.channels.begin(), recording_.channels.end(),
                                       [&](const auto& c) { return c.name == path_ + ".pose_" + foot; });
        if (pose == recording_.channels.end()) return;
        const Vector f = values(wrench, t), H = values(*pose, t);
        add(physics::contact_force(Eigen::Map<const Eigen::Matrix4d>(H.data()), f), arrows);
    }

    void add(const std::optional<physics::ContactForce>& contact, std::vector<physics::Arrow>& arrows) const {
        if (contact)
            arrows.push_back({contact->origin, contact->force * renderer_->options().metres_per_newton,
                              physics::Arrow::Kind::contact});
    }

    void add_push(const recording::Channel& push, double t, std::vector<physics::Arrow>& arrows) {
        const Vector f = values(push, t), H = values(*base_, t);
        if (f.head<3>().norm() < 1) return;
        const Eigen::Map<const Eigen::Matrix4d> w_H_b(H.data());
        const Eigen::Vector3d vector = f.head<3>() * 4 * renderer_->options().metres_per_newton;
        // The arrow ends at the chest, some 20 cm above the base.
        arrows.push_back({w_H_b.topRightCorner<3, 1>() + Eigen::Vector3d(0, 0, 0.2) - vector, vector,
                          physics::Arrow::Kind::push});
    }

    const std::string file_;
    const FilmOptions& options_;
    recording::Recording recording_;
    LoadedModel loaded_;
    std::string path_; ///< of the world's block
    const physics::Scene* scene_ = nullptr;
    std::optional<physics::Renderer> renderer_;
    const recording::Channel* base_ = nullptr; ///< of a MujocoWorld
    const recording::Channel* positions_ =
        nullptr; ///< of its joints, or all of a World; none: it has no joints
    std::vector<std::pair<physics::Frame, const recording::Channel*>>
        sensors_;                        ///< of contacts, with wrenches
    std::vector<physics::Line> trails_;  ///< until `trailed_`
    std::vector<physics::Frame> bodies_; ///< that have them
    double trailed_ = 0;
};

/// All takes side by side.
class Film {
  public:
    explicit Film(const FilmOptions& options) : options_(options) {
        const auto count = static_cast<int>(options.recordings.size());
        const int width =
            options.picture_options.width == 0 ? count * width_of_one : options.picture_options.width;
        if (width < 16 * count)
            throw CommandError("--width " + std::to_string(width) + " is too little for " +
                               std::to_string(count) + " recordings; give 16 pixels for each at least");
        int left = width;
        for (const auto& file : options.recordings) {
            const int own = left / (count - static_cast<int>(takes_.size()));
            takes_.emplace_back(file, options, own);
            left -= own;
        }
        whole_ = {
            width, options.picture_options.height,
            std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width * options.picture_options.height))};
    }

    const std::list<Take>& takes() const { return takes_; }
    int width() const { return whole_.width; }
    int height() const { return whole_.height; }
    double end() const {
        double last = 0;
        for (const auto& take : takes_) last = std::max(last, take.end());
        return last;
    }
    void begin(double t) {
        for (auto& take : takes_) take.begin(t);
    }
    /// A take that has ended stands still.
    const physics::Image& draw(double t) {
        std::size_t column = 0;
        for (auto& take : takes_) {
            take.draw(t, takes_.size() > 1 ? fs::path(take.file()).stem().string() : "", part_);
            const std::size_t row = 3 * static_cast<std::size_t>(part_.width);
            for (std::size_t y = 0; y < static_cast<std::size_t>(part_.height); ++y)
                std::copy_n(part_.pixels.begin() + static_cast<std::ptrdiff_t>(y * row), row,
                            whole_.pixels.begin() +
                                static_cast<std::ptrdiff_t>(
                                    3 * (y * static_cast<std::size_t>(whole_.width) + column)));
            column += static_cast<std::size_t>(part_.width);
        }
        return whole_;
    }

  private:
    const FilmOptions& options_;
    std::list<Take> takes_; ///< which stay where they are
    physics::Image part_, whole_;
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
    const double t = options.picture_time.value_or(film.end());
    refuse_after_end(film, "--at", t);
    refuse_after_end(film, "--from", options.from);
    film.begin(options.from);
    OutputFile file(options.picture);
    physics::write_png(file.path(), film.draw(t));
    file.commit();
    std::printf("%s\n", options.picture.c_str());
}

void draw_film(Film& film, const FilmOptions& options) {
    refuse_after_end(film, "--from", options.from);
    film.begin(options.from);
    OutputFile file(options.output);
    const InterruptGuard guard;
    physics::VideoWriter video(file.path(), film.width(), film.height(), options.frames_per_second);
    const double step = options.speed / options.frames_per_second;
    const int frames = static_cast<int>((film.end() - options.from) / step) + 1;
    StatusLine line;
    const auto text = [&](int done) {
        return "  frame " + std::to_string(done) + " of " + std::to_string(frames);
    };
    for (int i = 0; i < frames; ++i) {
        const physics::Image& image = film.draw(options.from + i * step);
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
    if (options.picture_time && options.picture.empty())
        throw CommandError("--at is the instant of a picture: give --picture FILE.png, too");
    refuse_other_format("-o", options.output, ".mp4");
    refuse_other_format("--picture", options.picture, ".png");
    Film film(options);
    FileSet read(options.recordings.begin(), options.recordings.end());
    for (const auto& take : film.takes()) read.merge(take.files());
    refuse_overwriting({{"-o", options.output}, {"--picture", options.picture}}, read);
    if (!options.picture.empty()) draw_picture(film, options);
    if (!options.output.empty()) draw_film(film, options);
    for (const auto& take : film.takes())
        refuse_incomplete(take.recording(), take.file(),
                          options.output.empty() ? options.picture : options.output);
}

} // namespace

void add_film(CLI::App& app) {
    auto* command = app.add_subcommand("film", "render recordings of physics worlds");
    auto options = std::make_shared<FilmOptions>();
    const auto number_option = [&](const char* name, auto& value, const char* doc, const char* unit) {
        return command->add_option(name, value, doc)->type_name(unit);
    };
    command
        ->add_option("RECORDINGS", options->recordings,
                     "MCAP files that bf run wrote, with their models; several are shown side by side")
        ->required()
        ->type_name("");
    command->add_option("-o,--output", options->output, "MP4 film")->type_name("FILE");
    command->add_option("--picture", options->picture, "PNG picture of one moment")->type_name("FILE");
    number_option("--at", options->picture_time, "time of the picture; otherwise the end", "T")
        ->check(between(0.0, 1e9));
    number_option("--from", options->from, "where the film and trails begin, s", "T")
        ->check(between(0.0, 1e9));
    number_option("--to", options->to, "where the film ends, s", "T")->check(between(0.0, 1e9));
    number_option("--fps", options->frames_per_second, "frames per second", "N")
        ->check(between(1.0, 1000.0))
        ->capture_default_str();
    number_option("--speed", options->speed, "2 plays twice as fast", "FACTOR")
        ->check(between(1e-3, 1e3))
        ->capture_default_str();
    command->add_flag("--com", options->shows_com,
                      "show the centre of mass of each robot, and its place on the floor");
    command->add_flag(
        "--support", options->shows_support,
        "show the support polygon of each robot that floats: the convex hull of where it touches "
        "what stands still");
    command
        ->add_option(
            "--trail", options->trails,
            "show where this body has been: a link, in a World ROBOT/LINK or an object; may be repeated")
        ->type_name("BODY")
        ->allow_extra_args(false);
    auto& picture = options->picture_options;
    command
        ->add_option(
            "--follow", picture.followed,
            "the camera goes along with this body; otherwise with the base of a MujocoWorld's robot, "
            "and it stays where it is in a World")
        ->type_name("BODY");
    number_option(
        "--distance", picture.distance,
        "of the camera from the point it looks at, m; otherwise such that all that moves is seen at "
        "first",
        "M")
        ->check(between(1e-3, 1e6));
    number_option("--azimuth", picture.azimuth,
                  "direction of view about z, deg: 0 along x, 180 facing the robot", "DEG")
        ->check(between(-1e6, 1e6))
        ->capture_default_str();
    number_option("--elevation", picture.elevation, "deg; below 0 the camera looks down", "DEG")
        ->check(between(-90.0, 90.0))
        ->capture_default_str();
    number_option(
        "--look-at", picture.look_at_height,
        "height of the point looked at, m; otherwise that of what is followed, or the middle of all "
        "that moves",
        "M")
        ->check(between(-1e6, 1e6));
    command->add_flag_callback(
        "--no-follow", [&picture] { picture.follows = false; },
        "the camera stays where it is when the base moves");
    number_option("--width", picture.width, "pixels of the whole film; 0: 640 for each recording", "N")
        ->check(between(0, 8192))
        ->capture_default_str();
    number_option("--height", picture.height, "pixels", "N")->check(between(16, 8192))->capture_default_str();
    command->add_flag_callback(
        "--1080p",
        [&picture] {
            picture.width = 1920;
            picture.height = 1080;
        },
        "1920 x 1080 pixels");
    command->footer(
        "The model's MujocoWorld or World block is shown. Of the one w_H_b and s must be recorded, of the "
        "other q. Forces are arrows where they are recorded: wrench_ and pose_ of feet, wrench of a "
        "WorldContact.\n"
        "Examples:\n"
        "  bf film run.mcap -o film.mp4 --1080p --com --support\n"
        "  bf film run.mcap --picture end.png --trail l_sole --trail r_sole\n"
        "  bf film before.mcap after.mcap -o both.mp4");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
