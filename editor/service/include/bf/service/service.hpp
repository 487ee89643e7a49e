// What pages ask for, and what they are told.
#pragma once

#include "bf/service/playback.hpp"
#include "bf/service/project.hpp"
#include "bf/service/scenery.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace bf::service {

/// Answers the pages that look at one opened folder: its models, one of which is open, its checks and its
/// run. Knows no network. All functions are called in one thread; what other threads find out (a check of the
/// model, samples) comes back to it by `post`.
class Service {
  public:
    struct Options {
        /// The opened model; all others are looked for in its folder and below. Empty: that of the recording,
        /// with the values that the recorded run had; it is in no file, and what is edited is kept nowhere.
        std::filesystem::path file;
        std::string version;                             ///< of the program
        std::function<void(std::function<void()>)> post; ///< runs a task in the thread of the service, later
        std::function<void(const std::string& text)> tell;  ///< a notification, for all pages
        std::function<void(const std::string& frame)> send; ///< a binary frame, for all pages
        MakeSceneries sceneries = {}; ///< of models with worlds; none: nothing stands in space
        /// ws://HOST:PORT/?token=TOKEN or unix:PATH?token=TOKEN of a program that runs the model and is
        /// served live: its run is that of the pages. Empty: they have one of their own.
        std::string attach = {};
        std::filesystem::path recording = {}; ///< which is looked at in place of a run
    };

    /// Throws model::Errors, FileError when the model cannot be read.
    explicit Service(Options options);
    ~Service();
    Service(const Service&) = delete;
    Service& operator=(const Service&) = delete;

    /// A request of JSON-RPC, and its answer. `page` tells pages apart.
    std::string answer(int page, std::string_view request);
    void leave(int page); ///< its wishes are forgotten
    /// What pages may have by HTTP, "meshes/SCENE/WORLD", "recordings/NUMBER/INDEX" and "images/NUMBER.png",
    /// as far as they were told of it; never a file by its name.
    std::optional<std::string> data(std::string_view what) const;
    /// A few times a second: looks after files.
    void tick();
    /// At the end: as Project::unsaved.
    std::string unsaved();

    /// The protocol in TypeScript, for the page.
    static std::string typescript();

    struct State;

  private:
    std::unique_ptr<State> state_;
};

} // namespace bf::service
