// bf doctor: what this machine has.
#include "bf/realtime/pacer.hpp"
#include "session.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <thread>
#include <unistd.h>

namespace bf::tools {

namespace {

bool has_program(const char* name) {
    const char* path = std::getenv("PATH");
    std::string rest = path ? path : "";
    for (std::size_t end = 0; end != std::string::npos;) {
        end = rest.find(':');
        if (access((rest.substr(0, end) + "/" + name).c_str(), X_OK) == 0) return true;
        if (end != std::string::npos) rest = rest.substr(end + 1);
    }
    return false;
}

std::string limit_text(int resource) {
    rlimit limit{};
    if (getrlimit(static_cast<__rlimit_resource_t>(resource), &limit) != 0) return "unknown";
    return limit.rlim_cur == RLIM_INFINITY ? "unlimited" : std::to_string(limit.rlim_cur);
}

/// The first line of a file of the system; empty when there is none.
std::string system_line(const char* file) {
    std::string line;
    std::getline(std::ifstream(file), line);
    return line;
}

/// What a loop in real time needs of the machine, each with what to do where it is missing.
nlohmann::ordered_json examine_real_time(const utsname& system) {
    nlohmann::ordered_json list;
    const auto add = [&](const char* name, bool is_good, const std::string& found,
                         const std::string& remedy) {
        list.push_back({{"name", name}, {"good", is_good}, {"found", found}});
        if (!is_good) list.back()["remedy"] = remedy;
    };
    const bool is_rt = std::string(system.version).find("PREEMPT_RT") != std::string::npos;
    add("kernel", is_rt, is_rt ? "PREEMPT_RT" : "without PREEMPT_RT",
        "wake-ups may be late by milliseconds: install the package linux-image-rt-amd64 of Debian, or a "
        "kernel with PREEMPT_RT");
    const auto granted = [&](const char* name, realtime::ThreadOptions options, int limit) {
        std::vector<std::string> refused; // in a thread of its own, which takes the priority with it
        std::thread([&] { refused = realtime::prepare_thread(options); }).join();
        add(name, refused.empty(),
            (refused.empty() ? "granted; limit " : "refused; limit ") + limit_text(limit),
            refused.empty() ? "" : refused[0]);
    };
    granted("priority", {.priority = 50, .cpu = -1, .locks_memory = false, .stack = 0}, RLIMIT_RTPRIO);
    granted("memory", {.priority = 0, .cpu = -1, .locks_memory = true, .stack = 0}, RLIMIT_MEMLOCK);
    munlockall();
    const auto governor = system_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
    add("governor", governor.empty() || governor == "performance",
        governor.empty() ? "the kernel does not scale the frequency" : governor,
        "processors that slow down lengthen the steps: 'sudo cpupower frequency-set -g performance'");
    const auto isolated = system_line("/sys/devices/system/cpu/isolated");
    add("processors", !isolated.empty(), isolated.empty() ? "none isolated" : "isolated: " + isolated,
        "others may run beside the loop: boot with isolcpus=N and run with --cpu N");
    return list;
}

/// Ways to robots of other programs, each a plugin that was tried, and what is missing.
nlohmann::ordered_json examine_middlewares(const nlohmann::ordered_json& plugins) {
    nlohmann::ordered_json list;
    const auto add = [&](const char* name, const char* plugin, const char* build,
                         const std::string& missing) {
        const auto tried = std::find_if(plugins.begin(), plugins.end(),
                                        [&](const auto& entry) { return entry["name"] == plugin; });
        std::string remedy = missing;
        if (tried == plugins.end())
            remedy = std::string("there is no plugin ") + plugin + ": " + build;
        else if (tried->contains("error"))
            remedy = (*tried)["error"];
        list.push_back({{"name", name}, {"plugin", plugin}, {"good", remedy.empty()}});
        if (!remedy.empty()) list.back()["remedy"] = remedy;
    };
    add("shared memory", "SharedMemory", "build BlockFactory with BF_ROBOTS=ON",
        access("/dev/shm", W_OK) == 0 ? "" : "/dev/shm cannot be written: mount a tmpfs there");
    add("UDP", "Udp", "build BlockFactory with BF_ROBOTS=ON", "");
    add("YARP", "Yarp", "run scripts/deps-yarp in the folder of the sources, some minutes, and build again",
        "");
    add("ROS 1", "Ros1", "run scripts/deps-ros1 in the folder of the sources, a minute, and build again", "");
    add("ROS 2", "Ros2", "run scripts/deps-ros2 in the folder of the sources, half a minute, and build again",
        "");
    return list;
}

nlohmann::ordered_json examine() {
    utsname system{};
    uname(&system);
    auto registry = make_registry();
    nlohmann::ordered_json json;
    json["version"] = BF_VERSION;
    json["system"] = std::string(system.sysname) + " " + system.release + " " + system.machine;
    json["processors"] = std::thread::hardware_concurrency();
    json["real_time"] = examine_real_time(system);
    std::istringstream libraries(BF_LIBRARIES);
    for (std::string name, version; libraries >> name >> version;) json["libraries"][name] = version;
    for (const auto& [program, use] : {std::pair("gnuplot", "bf plot"), std::pair("ffmpeg", "bf film")})
        json["programs"][program] = {{"found", has_program(program)}, {"used_by", use}};
    for (const auto& folder : registry->search_path())
        json["plugin_folders"].push_back(
            {{"path", folder.string()}, {"exists", std::filesystem::exists(folder)}});
    json["plugins"] = nlohmann::ordered_json::array();
    for (const auto& plugin : registry->available_plugins()) {
        nlohmann::ordered_json entry{{"name", plugin}};
        try {
            const auto before = registry->classes().size();
            registry->load_plugin(plugin);
            entry["blocks"] = registry->classes().size() - before;
        } catch (const PluginError& error) {
            entry["error"] = error.what();
        }
        json["plugins"].push_back(std::move(entry));
    }
    json["middlewares"] = examine_middlewares(json["plugins"]);
    json["robot_models"] = {{"path", BF_ROBOT_MODELS "/iCub"},
                            {"exists", std::filesystem::exists(BF_ROBOT_MODELS "/iCub")}};
    return json;
}

void print(const nlohmann::ordered_json& json) {
    const auto text = [](const nlohmann::ordered_json& value) { return value.get<std::string>(); };
    const auto line = [](const char* what, bool is_good, const std::string& more) {
        std::printf("%-12s %-4s %s\n", what, is_good ? "yes" : "NO", more.c_str());
    };
    std::printf("BlockFactory %s on %s, %d processors\n\n", text(json["version"]).c_str(),
                text(json["system"]).c_str(), json["processors"].get<int>());
    for (const auto& entry : json["real_time"]) {
        line("real time", entry["good"], text(entry["name"]) + ": " + text(entry["found"]));
        if (entry.contains("remedy")) std::printf("%-17s %s\n", "", text(entry["remedy"]).c_str());
    }
    std::string libraries;
    for (const auto& [name, version] : json["libraries"].items())
        libraries += (libraries.empty() ? "" : ", ") + name + " " + text(version);
    std::printf("%-12s      %s\n", "libraries", libraries.c_str());
    for (const auto& [name, entry] : json["programs"].items())
        line("program", entry["found"], name + ", used by " + text(entry["used_by"]));
    for (const auto& folder : json["plugin_folders"])
        line("plugins in", folder["exists"], text(folder["path"]));
    for (const auto& plugin : json["plugins"])
        if (plugin.contains("error"))
            line("plugin", false, text(plugin["error"]));
        else
            line("plugin", true,
                 text(plugin["name"]) + ", " + std::to_string(plugin["blocks"].get<int>()) + " blocks");
    for (const auto& entry : json["middlewares"]) {
        line("middleware", entry["good"], text(entry["name"]) + ", plugin " + text(entry["plugin"]));
        if (entry.contains("remedy")) std::printf("%-17s %s\n", "", text(entry["remedy"]).c_str());
    }
    line("robots", json["robot_models"]["exists"], text(json["robot_models"]["path"]));
}

bool has_broken_plugin(const nlohmann::ordered_json& json) {
    return std::any_of(json["plugins"].begin(), json["plugins"].end(),
                       [](const auto& p) { return p.contains("error"); });
}

} // namespace

void add_doctor(CLI::App& app) {
    auto* command = app.add_subcommand("doctor", "what this machine has: real-time limits, programs, plugins "
                                                 "and where they were searched, middlewares");
    auto as_json = std::make_shared<bool>(false);
    command->add_flag("--json", *as_json, "print as JSON");
    command->footer("What is missing is marked NO. Exit code 1 when a plugin is broken.\nExample: bf doctor");
    command->callback([as_json] {
        const auto json = examine();
        if (*as_json)
            std::fputs(to_text(json).c_str(), stdout);
        else
            print(json);
        if (has_broken_plugin(json)) throw CommandError("a plugin cannot be loaded");
    });
}

} // namespace bf::tools
