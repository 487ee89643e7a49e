#include "clients.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/clock.hpp"
#include "network.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <yarp/os/ConnectionReader.h>
#include <yarp/os/Contact.h>
#include <yarp/os/ContactStyle.h>
#include <yarp/os/Network.h>
#include <yarp/os/SystemClock.h>

namespace bf::yarp {

namespace os = ::yarp::os;

namespace {

constexpr float longest_answer = 2;     ///< s
constexpr double longest_way = 1;       ///< s of a command whose sender has gone
constexpr double longest_start = 10;    ///< s until a client says whether it is a diagram
constexpr const char* asks = "/rpc:o";  ///< ends the port by which remote_controlboard asks its board
constexpr const char* asked = "/rpc:i"; ///< that of the board
constexpr const char* tells = "/driver";

} // namespace

std::optional<std::vector<std::string>> Clients::ask() {
    if (port_.getOutputCount() == 0) {
        port_.close();
        port_.setAdminMode(); // what it is asked, the port itself answers, not the board behind it
        port_.setTimeout(longest_answer);
        if (!port_.open("...") || !os::NetworkBase::connect(port_.getName(), board_ + asked, "tcp", true))
            return std::nullopt;
    }
    os::Bottle question, answer;
    question.fromString("[list] [in]");
    if (!port_.write(question, answer)) return std::nullopt;
    std::vector<std::string> clients;
    for (std::size_t i = 0; i < answer.size(); ++i)
        if (std::string name = answer.get(i).asString(); name.ends_with(asks))
            clients.push_back(std::move(name));
    return clients;
}

Driver::Driver(const std::vector<std::string>& joints) {
    for (const auto& joint : joints) joints_.addString(joint);
    port_.setReader(*this);
}
Driver::~Driver() {
    port_.interrupt();
    port_.close();
}

bool Driver::open(const std::string& prefix) {
    port_.close();
    return port_.open(prefix + tells);
}

bool Driver::read(os::ConnectionReader& reader) {
    os::Bottle question;
    if (!question.read(reader)) return false;
    auto* writer = reader.getWriter();
    return writer == nullptr || joints_.write(*writer);
}

std::vector<std::string> joints_driven_by(const std::string& client, const std::string& board) {
    const std::string end = board + asks;
    if (!client.ends_with(end)) return {};
    os::ContactStyle style;
    style.quiet = true;
    style.timeout = longest_answer;
    os::Bottle question, answer;
    question.addString("joints");
    const std::string driver = client.substr(0, client.size() - end.size()) + tells;
    if (!os::NetworkBase::write(os::Contact(driver), question, answer, style)) return {};
    std::vector<std::string> joints;
    for (std::size_t i = 0; i < answer.size(); ++i) joints.push_back(answer.get(i).asString());
    return joints;
}

void await_joints(const std::string& robot, const std::vector<std::string>& boards,
                  const std::vector<std::string>& joints, const std::string& prefix, double end) {
    std::list<Clients> all(boards.begin(), boards.end());
    const auto is_ours = [&](const std::string& joint) {
        return std::ranges::find(joints, joint) != joints.end();
    };
    const auto why_not = [&]() -> std::string {
        for (auto& each : all) {
            const auto clients = each.ask();
            if (!clients) return each.board() + " does not say who is connected to it; look at the network";
            for (const auto& client : *clients) {
                if (client.starts_with(prefix + "/")) continue;
                const auto theirs = joints_driven_by(client, each.board());
                if (const auto joint = std::ranges::find_if(theirs, is_ours); joint != theirs.end())
                    return "the diagram with the port " + client + " drives its joint '" + *joint +
                           "'; end that one first, or give each diagram joints of its own";
            }
        }
        return "";
    };
    bool is_told = false;
    for (std::string why; !(why = why_not()).empty(); os::SystemClock::delaySystem(0.05)) {
        if (is_interrupted()) throw std::runtime_error(interrupted);
        if (middleware::now() > end) throw std::runtime_error(why);
        if (!std::exchange(is_told, true))
            tell_wait(("the joints of YARP robot '" + robot + "': " + why).c_str());
    }
}

bool Leaving::look(std::uint64_t commands, bool is_driven) {
    const double now = middleware::now();
    for (auto& board : boards_) {
        const auto clients = board.ask();
        if (!clients) return false; // nobody knows
        for (const auto& client : *clients) {
            auto& its = lately_.try_emplace(client, Client{now, now, false}).first->second;
            its.last = now;
            // One that is busy may answer late.
            if (!its.is_diagram && now - its.first < longest_start)
                its.is_diagram = !joints_driven_by(client, board.board()).empty();
        }
    }
    std::erase_if(lately_, [&](const auto& each) { return now - each.second.last > longest_way; });
    if (!is_driven) {
        may_have_sent_.clear();
        return false;
    }
    if (may_have_sent_.empty() || commands != commands_)
        for (const auto& [client, its] : lately_) may_have_sent_[client] |= its.is_diagram;
    commands_ = commands;
    const bool are_diagrams =
        std::ranges::any_of(may_have_sent_, [](const auto& each) { return each.second; });
    const auto is_there = [&](const auto& each) {
        const auto found = lately_.find(each.first);
        return (each.second || !are_diagrams) && found != lately_.end() && found->second.last == now;
    };
    return !may_have_sent_.empty() && std::ranges::none_of(may_have_sent_, is_there);
}

} // namespace bf::yarp
