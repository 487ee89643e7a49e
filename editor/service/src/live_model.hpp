#pragma once

#include "bf/library/load.hpp"
#include "bf/service/moves.hpp"
#include "live.hpp"
#include "values.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace bf::service {

/// The document beside a program that is attached: what the program has otherwise, and edits that go on in
/// it. One thread.
class LiveModel {
  public:
    /// A model as the document has become.
    struct Newest {
        std::shared_ptr<const LoadedModel> model;
        std::int64_t revision = 0;
        std::string what; ///< names the edit
        int page = 0;     ///< that made it; 0: somebody else, in the file
        Moves moves = {};
    };

    /// The program is taken to run the document of that revision. `post` brings a task to the thread;
    /// `tell` is called where something is new.
    LiveModel(Live& live, std::int64_t revision, std::function<void(std::function<void()>)> post,
              std::function<void()> tell);

    /// The document is right. It goes on in the program, unless that would lose something.
    void consider(Newest newest);
    /// So does one that is not there yet: the program can be reached again.
    void go_on();
    /// The revision that the program runs.
    std::int64_t there() const { return there_; }
    /// Throws std::runtime_error where the program lets nobody change anything.
    void require_control() const;
    /// It goes on all the same. Throws std::runtime_error where none waits.
    void adopt(int page);
    /// What the program tells of its run, with what waits; of its values those that the model has otherwise.
    RunState seen(RunState state, std::int64_t revision) const;

  private:
    void send(bool accepts_loss);
    void hear(std::int64_t revision, std::optional<RunEdit> waits);

    Live& live_;
    const std::function<void(std::function<void()>)> post_;
    const std::function<void()> tell_;
    Values values_; ///< of the newest model
    Newest newest_;
    std::int64_t there_;
    std::optional<std::int64_t> on_the_way_ = {};
    std::optional<RunEdit> waits_ = {};
};

} // namespace bf::service
