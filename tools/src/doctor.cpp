// bf doctor: what this machine has.
#include "session.hpp"
#include "verbs.hpp"

#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
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

nlohmann::ordered_json examine() {
    utsname system{};
    uname(&system);
    auto registry = make_registry();
    nlohmann::ordered_json json;
    json["version"] = BF_VERSION;
    json["system"] = std::string(system.sysname) + " " + system.release + " " + system.machine;
    json["processors"] = std::thread::hardware_concurrency();
    json["real_time"]["priority_limit"] = limit_text(RLIMIT_RTPRIO);
    json["real_time"]["locked_memory_limit"] = limit_text(RLIMIT_MEMLOCK);
    json["real_time"]["preempt_rt"] = std::string(system.version).find("PREEMPT_RT") != std::string::npos;
    for (const auto& [program, use] : {std::pair("gnuplot", "bf plot"), std::pair("ffmpeg", "bf film")})
        json["programs"][program] = {{"found", has_program(program)}, {"used_by", use}};
    for (const auto& folder : registry->search_path())
        json["plugin_folders"].push_back({{"path", folder.string()}, {"exists", std::filesystem::exists(folder)}});
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
    json["robot_models"] = {{"path", BF_ROBOT_MODELS "/iCub"}, {"exists", std::filesystem::exists(BF_ROBOT_MODELS "/iCub")}};
    return json;
}

void print(const nlohmann::ordered_json& json) {
    const auto mark = [](bool good) { return good ? "yes" : "NO "; };
    std::printf("BlockFactory %s on %s, %d processors\n\n", json["version"].get<std::string>().c_str(), json["system"].get<std::string>().c_str(), json["processors"].get<int>());
    std::printf("real time   priority limit %s, locked memory limit %s, PREEMPT_RT kernel %s\n", json["real_time"]["priority_limit"].get<std::string>().c_str(),
                json["real_time"]["locked_memory_limit"].get<std::string>().c_str(), mark(json["real_time"]["preempt_rt"]));
    for (const auto& [name, entry] : json["programs"].items())
        std::printf("program     %s  %s, used by %s\n", mark(entry["found"]), name.c_str(), entry["used_by"].get<std::string>().c_str());
    for (const auto& folder : json["plugin_folders"]) std::printf("plugins in  %s  %s\n", mark(folder["exists"]), folder["path"].get<std::string>().c_str());
    for (const auto& plugin : json["plugins"]) {
        if (plugin.contains("error")) std::printf("plugin      NO   %s\n", plugin["error"].get<std::string>().c_str());
        else std::printf("plugin      yes  %s, %d blocks\n", plugin["name"].get<std::string>().c_str(), plugin["blocks"].get<int>());
    }
    std::printf("robots      %s  %s\n", mark(json["robot_models"]["exists"]), json["robot_models"]["path"].get<std::string>().c_str());
}

} // namespace

void add_doctor(CLI::App& app) {
    auto* command = app.add_subcommand("doctor", "what this machine has: programs, real-time limits, plugins and where they were searched");
    auto as_json = std::make_shared<bool>(false);
    command->add_flag("--json", *as_json, "print as JSON");
    command->footer("Example: bf doctor");
    command->callback([as_json] {
        const auto json = examine();
        if (*as_json) std::printf("%s\n", json.dump(2).c_str());
        else print(json);
    });
}

} // namespace bf::tools
