// Edits of the model of a run: prepared beside loop and server, taken over by the loop.
#include "server_state.hpp"

#include <algorithm>
#include <sys/resource.h>

namespace bf::realtime {

void Server::State::Edits::end() {
    if (phase_ == Phase::posted)
        if (const auto step = state_.loop.succession->taken()) take(*step);
    if (worker_.joinable()) worker_.join();
    if (phase_ == Phase::posted) state_.loop.succession->withdraw();
    if (phase_ == Phase::finishing)
        answer(true);
    else if (phase_ != Phase::none && edited_.successor)
        state_.options.editing->finish(false);
    phase_ = Phase::none;
}

/// In a thread that gives way to all others.
void Server::State::Edits::work(std::function<void()> task) {
    is_done_ = false;
    worker_ = std::thread([this, task = std::move(task)] {
        ::setpriority(PRIO_PROCESS, 0, 10); // of this thread alone
        task();
        is_done_ = true;
    });
}

bool Server::State::Edits::has_worked() {
    if (!is_done_) return false;
    worker_.join();
    return true;
}

void Server::State::Edits::ask(const Json& request, Asked asked) {
    if (const std::string why = state_.why_not_edited(); !why.empty()) throw ClientError(why);
    asked.what = log_name(field<std::string>(request, "what"));
    asked.edit.text = field<std::string>(request, "model");
    asked.edit.files = field<std::map<std::string, std::string>>(request, "files");
    for (const auto& [path, before] : field<std::map<std::string, Json>>(request, "origins")) {
        if (!before.is_null() && !before.is_string())
            throw ClientError("the field 'origins' has a path or null for each path");
        asked.edit.origins[path] = before.is_null() ? std::nullopt : std::optional(before.get<std::string>());
    }
    asked.edit.is_by_hand = field<bool>(request, "is_by_hand");
    asked.edit.accepts_loss = field<bool>(request, "accepts_loss");
    asked.edit.is_late = field<std::int64_t>(request, "after") != count();
    if (is_busy()) throw ClientError("another edit is under way; try again");
    if (const auto now = state_.loop.control.state(); now != Control::State::running)
        throw ClientError(now == Control::State::waiting
                              ? "the program waits to be started; edits go on from a run"
                              : "the program ends");
    asked_ = std::move(asked);
    phase_ = Phase::asked;
}

void Server::State::Edits::tick() {
    switch (phase_) {
    case Phase::none: break;
    case Phase::asked:
        if (!state_.posted.empty()) break; // the loop still has a change of parameters
        phase_ = Phase::preparing;
        edited_ = {};
        work([this] {
            try {
                edited_ = state_.options.editing->prepare(asked_.edit, state_.asked);
            } catch (const std::exception& error) {
                edited_ = {.refusal = error.what()};
            }
        });
        break;
    case Phase::preparing:
        if (has_worked()) post();
        break;
    case Phase::posted:
        if (const auto step = state_.loop.succession->taken()) take(*step);
        break;
    case Phase::finishing:
        if (!has_worked()) break;
        phase_ = Phase::none;
        answer(true); // now another one may follow
        break;
    }
}

void Server::State::Edits::post() {
    if (!edited_.successor) {
        phase_ = Phase::none;
        return answer(false);
    }
    next_table_ = std::make_unique<Table>(state_, edited_.successor->run().signals());
    std::vector<Run::Observer*> observers = edited_.observers;
    observers.push_back(next_table_.get());
    state_.loop.succession->post(*edited_.successor, observers);
    phase_ = Phase::posted;
}

/// The loop steps the successor from here on.
void Server::State::Edits::take(std::int64_t step) {
    State& s = state_;
    table_ = std::move(next_table_);
    s.run = &edited_.successor->run();
    s.asked = edited_.asked;
    ++count_;
    std::set<std::uint32_t> there{timing_channel, log_channel};
    for (const auto& row : table_->rows()) there.insert(row.number);
    Json gone = Json::array(), come = Json::array();
    for (std::uint32_t number = 0; number < s.channels.size(); ++number) {
        Channel& channel = s.channels[number];
        const bool was_there = std::exchange(channel.is_there, there.contains(number));
        if (channel.is_there && !was_there) come.push_back(channel.advertised);
        if (!channel.is_there && was_there) gone.push_back(number);
    }
    std::map<std::string, std::vector<double>> before;
    for (const auto& [name, parameter] : s.parameters) before[name] = parameter.values;
    s.know_parameters();
    table_->tell_constants();
    const auto everyone = s.sessions; // who reads nothing may leave
    for (const auto& session : everyone) {
        if (!session->is_open) continue;
        session->numbers.resize(s.channels.size(), -1);
        for (const auto& number : gone)
            if (const auto id = session->numbers[number.get<std::uint32_t>()]; id >= 0)
                session->unsubscribe(static_cast<std::uint32_t>(id));
        if (!gone.empty()) session->send({{"op", "unadvertise"}, {"channelIds", gone}});
        session->send({{"op", "advertise"}, {"channels", come}});
        std::vector<std::string> watched;
        for (const auto& [name, parameter] : s.parameters)
            if (session->watched.contains(name) && before[name] != parameter.values) watched.push_back(name);
        if (!watched.empty()) session->send(session->values_message(watched, {}));
    }
    const auto& entry = s.log.add(s.time, asked_.who, "edit: " + asked_.what);
    s.tell_log(entry);
    if (s.options.on_edit) s.options.on_edit(step, entry.entry);
    s.tell_timing();
    phase_ = Phase::finishing;
    work([this] { state_.options.editing->finish(true); });
}

void Server::State::Edits::answer(bool is_made) {
    const auto session = asked_.session.lock();
    if (!session) return;
    session->answer({asked_.head + to_text(Json{{"success", true},
                                                {"is_made", is_made},
                                                {"refusal", edited_.refusal},
                                                {"lost", edited_.lost},
                                                {"begun", edited_.begun},
                                                {"unclear", edited_.unclear},
                                                {"edits", count()}}),
                     false});
}

} // namespace bf::realtime
