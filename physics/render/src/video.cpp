#include "bf/physics/renderer.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <spawn.h>
#include <stdexcept>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

extern char** environ;

namespace bf::physics {

namespace {

/// ffmpeg with raw frames on its standard input. A socket instead of a pipe, because writing to a dead pipe
/// would end this process with a signal.
class Ffmpeg {
  public:
    Ffmpeg(const std::filesystem::path& file, int width, int height, const std::vector<std::string>& input,
           const std::vector<std::string>& output)
        : file_(file), width_(width), height_(height) {
        std::vector<std::string> words{
            "ffmpeg",   "-loglevel", "error", "-y", "-f",
            "rawvideo", "-pix_fmt",  "rgb24", "-s", std::to_string(width) + "x" + std::to_string(height)};
        words.insert(words.end(), input.begin(), input.end());
        words.insert(words.end(), {"-i", "-"});
        words.insert(words.end(), output.begin(), output.end());
        words.push_back("file:" + file.string());
        start(std::move(words));
    }
    ~Ffmpeg() {
        if (child_ > 0) finish();
        if (log_) std::fclose(log_);
    }
    Ffmpeg(const Ffmpeg&) = delete;
    Ffmpeg& operator=(const Ffmpeg&) = delete;

    void write(const Image& image) {
        const size_t size = 3 * static_cast<size_t>(width_) * static_cast<size_t>(height_);
        if (image.width != width_ || image.height != height_ || image.pixels.size() != size)
            throw std::invalid_argument("'" + file_.string() + "' holds frames of " + std::to_string(width_) +
                                        " x " + std::to_string(height_) + " pixels; this one has " +
                                        std::to_string(image.width) + " x " + std::to_string(image.height));
        if (child_ <= 0) throw std::runtime_error("'" + file_.string() + "' is closed; no frame can follow");
        for (size_t sent = 0; sent < size;) {
            const ssize_t count = send(socket_, image.pixels.data() + sent, size - sent, MSG_NOSIGNAL);
            if (count < 0 && errno == EINTR) continue;
            if (count < 0) {
                finish();
                throw std::runtime_error(complaint());
            }
            sent += static_cast<size_t>(count);
        }
    }

    void close() {
        if (child_ > 0 && !finish()) throw std::runtime_error(complaint());
    }

  private:
    void start(std::vector<std::string> words) {
        int ends[2];
        log_ = std::tmpfile();
        if (!log_ || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
            throw std::runtime_error("cannot start ffmpeg for '" + file_.string() +
                                     "': " + std::strerror(errno));
        std::vector<char*> arguments;
        for (std::string& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
        posix_spawn_file_actions_adddup2(&actions, fileno(log_), STDERR_FILENO);
        const int problem = posix_spawnp(&child_, "ffmpeg", &actions, nullptr, arguments.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
        ::close(ends[1]);
        socket_ = ends[0];
        if (problem == 0) return;
        child_ = -1;
        ::close(socket_);
        std::fclose(std::exchange(log_, nullptr));
        throw std::runtime_error("cannot write '" + file_.string() + "': the program ffmpeg did not start (" +
                                 std::strerror(problem) + "); install ffmpeg or add it to PATH");
    }

    /// Ends the input and waits; true when ffmpeg succeeded.
    bool finish() {
        ::close(socket_);
        int status = 0;
        while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
        }
        child_ = -1;
        return WIFEXITED(status) && WEXITSTATUS(status) == 0;
    }

    std::string complaint() {
        char words[1000];
        std::rewind(log_);
        const size_t length = std::fread(words, 1, sizeof words, log_);
        return "ffmpeg could not write '" + file_.string() + "': " + std::string(words, length);
    }

    std::filesystem::path file_;
    int width_, height_;
    std::FILE* log_ = nullptr;
    int socket_ = -1;
    pid_t child_ = -1;
};

} // namespace

void write_png(const std::filesystem::path& file, const Image& image) {
    Ffmpeg ffmpeg(file, image.width, image.height, {},
                  {"-frames:v", "1", "-update", "1", "-f", "image2", "-c:v", "png"});
    ffmpeg.write(image);
    ffmpeg.close();
}

struct VideoWriter::Impl : Ffmpeg {
    using Ffmpeg::Ffmpeg;
};

VideoWriter::VideoWriter(const std::filesystem::path& file, int width, int height, double frames_per_second)
    : impl_(std::make_unique<Impl>(
          file, width, height, std::vector<std::string>{"-r", std::to_string(frames_per_second)},
          std::vector<std::string>{"-c:v", "libx264", "-preset", "veryfast", "-crf", "20", "-pix_fmt",
                                   "yuv420p", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-movflags",
                                   "+faststart", "-f", "mp4"})) {}

VideoWriter::~VideoWriter() = default;
VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;
VideoWriter& VideoWriter::operator=(VideoWriter&&) noexcept = default;

void VideoWriter::add(const Image& frame) { impl_->write(frame); }
void VideoWriter::close() { impl_->close(); }

} // namespace bf::physics
