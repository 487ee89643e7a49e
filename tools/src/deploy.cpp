// bf deploy: one folder that runs a model on a bare computer.
#include "bf/base/escape.hpp"
#include "bf/base/open_file.hpp"
#include "bf/codegen/generate.hpp"
#include "bf/engine/simulation.hpp"
#include "files.hpp"
#include "session.hpp"
#include "ssp.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <elf.h>
#include <fcntl.h>
#include <link.h>
#include <sched.h>
#include <set>
#include <sys/wait.h>
#include <unistd.h>

namespace bf::tools {

namespace {

namespace fs = std::filesystem;

/// Shell text: the folder of the script, which a link may lead to. A bare root has no readlink, and no links.
const std::string find_here = "self=$0\n[ ! -L \"$self\" ] || self=$(readlink -f -- \"$self\")\n"
                              "case $self in */*) ;; *) self=./$self ;; esac\n"
                              "here=$(CDPATH= cd -- \"${self%/*}\" && pwd) || exit 1\n";

struct DeployOptions {
    ModelOptions model;
    std::string folder, target, prefix;
};

/// A plugin that opens libraries in runs only has this function: it opens them all, and gives the files that
/// they read, up to null, which a package has in share/blockfactory. It may throw std::runtime_error:
///   extern "C" const char* const* bf_deploy_v1();
constexpr const char* deploy_symbol = "bf_deploy_v1";

/// The `bf` command, the shared libraries and plugins that it loads, and what plugins read.
struct Program {
    fs::path file;
    std::vector<fs::path> libraries, plugins, shared;
};

std::vector<fs::path> loaded_libraries() {
    std::vector<fs::path> loaded;
    dl_iterate_phdr(
        [](dl_phdr_info* info, std::size_t, void* list) {
            if (info->dlpi_name && info->dlpi_name[0] == '/')
                static_cast<std::vector<fs::path>*>(list)->emplace_back(info->dlpi_name);
            return 0;
        },
        &loaded);
    return loaded;
}

/// This one, with the plugins of the model that `registry` was filled for.
Program this_program(const Registry& registry) {
    Program program{fs::read_symlink("/proc/self/exe"), {}, {}, {}};
    std::set<fs::path> plugin_folders;
    for (const auto& folder : registry.search_path()) plugin_folders.insert(fs::weakly_canonical(folder));
    const auto is_plugin = [&](const fs::path& library) {
        return plugin_folders.contains(fs::weakly_canonical(library.parent_path()));
    };
    for (const auto& library : loaded_libraries()) {
        if (!is_plugin(library)) continue;
        program.plugins.push_back(library);
        void* const its = ::dlopen(library.c_str(), RTLD_NOW | RTLD_NOLOAD);
        if (!its) continue;
        if (auto* deploy = reinterpret_cast<const char* const* (*)()>(::dlsym(its, deploy_symbol)))
            for (const char* const* file = deploy(); *file; ++file) program.shared.emplace_back(*file);
        ::dlclose(its);
    }
    for (auto& library : loaded_libraries())
        if (!is_plugin(library)) program.libraries.push_back(std::move(library));
    return program;
}

bool is_for(const std::string& target, const fs::path& file) {
    Elf64_Ehdr header{};
    std::ifstream(file, std::ios::binary).read(reinterpret_cast<char*>(&header), sizeof header);
    return header.e_machine == (target == "aarch64" ? EM_AARCH64 : EM_X86_64);
}

/// The one for `target` in `prefix`, an installation or a package, with plugins named like `plugins`. Throws
/// CommandError when one is not there; `blocks` says who needs them.
Program installed_program(const fs::path& prefix, const std::string& target,
                          const std::vector<fs::path>& plugins, const std::string& blocks) {
    Program program{prefix / "bin/bf", {}, {}, {}};
    if (!is_for(target, program.file))
        throw CommandError("there is no BlockFactory for " + target + " in " + prefix.string() +
                           (blocks.empty() ? "" : ", which these blocks need:" + blocks) +
                           "\n'make aarch64' builds it for aarch64; --prefix names the folder of another "
                           "installation, or of a package made on such a computer");
    for (const auto& entry : fs::directory_iterator(prefix / "lib"))
        if (is_for(target, entry.path())) program.libraries.push_back(entry.path());
    for (const auto& plugin : plugins) {
        program.plugins.push_back(prefix / "lib/blockfactory" / plugin.filename());
        if (!is_for(target, program.plugins.back()))
            throw CommandError("there is no plugin " + program.plugins.back().string() + " for " + target +
                               "; build it for that (docs/how-to/deploy.md) and put it there, and the "
                               "libraries that it needs into " +
                               (prefix / "lib").string());
    }
    return program;
}

/// What the unit says of keys: its user, who exists only while it runs, can own none.
std::string credentials(const FileSet& keys) {
    if (keys.empty()) return "";
    std::set<std::string> names;
    for (const auto& key : keys) names.insert(key.filename());
    std::string text = "\n# Keys, which are root's: sudo install -D -m 600 -t /etc/credstore KEY\n";
    for (const auto& name : names) {
        std::string escaped;
        for (const char letter : name) escaped += letter == '%' ? "%%" : std::string(1, letter);
        text += "LoadCredential=" + escaped + ":/etc/credstore/" + escaped + "\n";
    }
    return text;
}

/// `options` of the program that make it run until it is told to end. The unit grants what real time needs
/// and takes the rest away: the model may come from somebody else, and its program talks to the network.
std::string service(const std::string& name, const Diagram& diagram, const std::string& options) {
    // The program's own watchdog tells more, so it comes first.
    const double watchdog = std::ceil(2 * std::max(5.0, 10 * diagram.step));
    const std::string folder = "/opt/" + name;
    return "# sudo cp -r . " + folder + " && sudo systemctl enable --now " + folder + "/" + name +
           ".service\n"
           "[Unit]\nDescription=BlockFactory model " +
           name +
           "\n\n[Service]\n"
           "# Ready when the first step has ended; ended when no step does for so many seconds.\n"
           "Type=notify\nWatchdogSec=" +
           number(watchdog) +
           "\n# Not started again by itself: a robot whose controller failed needs a look.\n"
           "Restart=no\nExecStart=" +
           folder + "/run " + options +
           "\n"
           "# The step under way ends, blocks stop, actuators are released.\n"
           "KillSignal=SIGTERM\nTimeoutStopSec=10\nSuccessExitStatus=143\n\n"
           "# A user of its own, who may write in /var/lib/" +
           name + " (recordings: --record run.mcap) and /run/" + name +
           " alone.\n"
           "DynamicUser=yes\nStateDirectory=" +
           name + "\nWorkingDirectory=%S/" + name + "\nRuntimeDirectory=" + name +
           "\nUMask=0077\nProtectSystem=strict\nProtectHome=yes\nPrivateTmp=yes\n" +
           credentials(secrets_of(diagram)) +
           "\n# Real time.\n"
           "LimitRTPRIO=98\nLimitMEMLOCK=infinity\n"
           "CapabilityBoundingSet=CAP_SYS_NICE CAP_IPC_LOCK\nAmbientCapabilities=CAP_SYS_NICE "
           "CAP_IPC_LOCK\n\n"
           "# A device is allowed by DeviceAllow=/dev/NAME rw, its group by SupplementaryGroups=GROUP.\n"
           "DevicePolicy=closed\n"
           "RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_CAN\n"
           "NoNewPrivileges=yes\nLockPersonality=yes\nMemoryDenyWriteExecute=yes\n"
           "ProtectClock=yes\nProtectControlGroups=yes\nProtectHostname=yes\nProtectKernelLogs=yes\n"
           "ProtectKernelModules=yes\nProtectKernelTunables=yes\nProtectProc=invisible\n"
           "RemoveIPC=yes\nRestrictNamespaces=yes\nRestrictSUIDSGID=yes\n"
           "SystemCallArchitectures=native\nSystemCallErrorNumber=EPERM\n"
           "SystemCallFilter=@system-service\nSystemCallFilter=~@privileged\n\n"
           "[Install]\nWantedBy=multi-user.target\n";
}

/// A command of a package: paths in it begin with the package's folder, which is "" where that is the root.
struct Trial {
    std::string loader;
    std::vector<std::string>
        files; ///< of the package, each an argument after --params; the first is the model
    std::vector<std::string> options; ///< as they are

    std::vector<std::string> command(const std::string& root) const {
        std::vector<std::string> all{root + "/" + loader, "--library-path", root + "/lib", root + "/bin/bf",
                                     "check"};
        for (std::size_t i = 0; i < files.size(); ++i) {
            if (i > 0) all.emplace_back("--params");
            all.push_back(root + "/" + files[i]);
        }
        all.insert(all.end(), options.begin(), options.end());
        return all;
    }
    static std::vector<std::string> environment(const std::string& root) {
        return {"BLOCKFACTORY_PLUGIN_PATH=" + root + "/lib/blockfactory",
                "YARP_DATA_DIRS=" + root + "/share:" + root + "/share/iCub"};
    }
};

/// For execve.
std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> all;
    for (auto& text : texts) all.push_back(text.data());
    all.push_back(nullptr);
    return all;
}

/// Lets the package check its model with nothing but itself in reach: in a root of its own where the system
/// allows that, otherwise with no environment and from another folder. Throws CommandError with what it says
/// when it cannot; gives how it was tried.
std::string tried(const fs::path& package, const Trial& trial) {
    const Waiting waiting("checking the package");
    auto alone = trial.command(""), beside = trial.command(package);
    auto alone_environment = Trial::environment(""), beside_environment = Trial::environment(package);
    const auto alone_arguments = pointers(alone), beside_arguments = pointers(beside),
               alone_variables = pointers(alone_environment), beside_variables = pointers(beside_environment);
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0)
        throw CommandError(std::string("cannot check the package: ") + std::strerror(errno));
    const pid_t child = ::fork();
    if (child == 0) { // calls that are safe beside threads only
        ::dup2(ends[1], 1);
        ::dup2(ends[1], 2);
        // Whoever is not root is it in a namespace of his own.
        const bool is_alone = ::chdir(package.c_str()) == 0 &&
                              (::chroot(".") == 0 || (::unshare(CLONE_NEWUSER) == 0 && ::chroot(".") == 0));
        [[maybe_unused]] const bool is_told = ::write(1, is_alone ? "a" : "b", 1) == 1 && ::chdir("/") == 0;
        if (is_alone)
            ::execve(alone_arguments[0], alone_arguments.data(), alone_variables.data());
        else
            ::execve(beside_arguments[0], beside_arguments.data(), beside_variables.data());
        ::_exit(127);
    }
    ::close(ends[1]);
    std::string text;
    char part[4096];
    for (ssize_t count = 0; (count = ::read(ends[0], part, sizeof part)) != 0;)
        if (count > 0)
            text.append(part, static_cast<std::size_t>(count));
        else if (errno != EINTR)
            break;
    ::close(ends[0]);
    int status = 0;
    while (child > 0 && ::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    const bool is_alone = text.starts_with('a');
    if (!text.empty()) text.erase(0, 1);
    if (child < 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw CommandError(
            "the package would not start on another computer; its own check says:\n" + text +
            "put all files that the model reads beside it and name them relative to it; nothing was "
            "written");
    return is_alone ? "checked in an empty root"
                    : "checked beside the files of this machine, which allows no empty root";
}

/// The program and all that the model needs, with the system's own libraries: nothing but a kernel and a
/// shell is asked of the other computer.
/// Gives the command that checks it there.
Trial pack_program(const Program& program, const LoadedModel& loaded, const ModelOptions& options,
                   const std::string& name, const OutputFolder& folder) {
    const fs::path model = loaded.source.file, model_folder = model.parent_path();
    // Those of unused variants too, for values may be changed where the package runs.
    FileSet files = files_of(loaded);
    files.merge(files_of(loaded.source.file, loaded.source.texts));
    // A system goes as the model that it is, with its FMUs among the plugins: a bare root has nowhere to
    // unpack it.
    const fs::path place = is_system(model) ? fs::path("model") / model.filename().replace_extension(".yaml")
                                            : packed_place(model, model_folder, "deploy");
    for (const auto& file : without_secrets(std::move(files), loaded))
        if (is_system(file))
            folder.write(place, loaded.source.texts.at(file));
        else
            folder.copy(file, packed_place(file, model_folder, "deploy"));

    folder.copy(program.file, "bin/bf");
    std::string loader;
    for (const auto& library : program.libraries) {
        folder.copy(library, "lib" / library.filename());
        if (library.filename().string().starts_with("ld-linux")) loader = library.filename();
    }
    for (const auto& plugin : program.plugins) folder.copy(plugin, "lib/blockfactory" / plugin.filename());
    for (const auto& file : program.shared) folder.copy(file, "share/blockfactory" / file.filename());
    for (const auto& [its, file] : fmus_of(loaded.diagram)) folder.copy(file, "lib/blockfactory/" + its);
    if (loader.empty())
        throw CommandError("glibc's dynamic loader, ld-linux*, is not among the libraries of " +
                           program.file.string());

    Trial trial{"lib/" + loader, {place}, {}};
    std::string arguments;
    for (std::size_t i = 0; i < options.params.size(); ++i) {
        const std::string to = "model/parameters" + std::to_string(i + 1) + ".yaml";
        folder.copy(options.params[i], to);
        arguments += " --params \"$here/" + to + "\"";
        trial.files.push_back(to);
    }
    for (const auto& set : options.sets) {
        arguments += " --set " + escape::shell(set);
        trial.options.insert(trial.options.end(), {"--set", set});
    }
    folder.write("run",
                 "#!/bin/sh\n# Runs " + name +
                     " in real time; './run --help' tells more. Any other verb: ./bf VERB ...\n" + find_here +
                     "exec \"$here/bf\" run \"$here\"/" + escape::shell(place.string()) + " --realtime" +
                     arguments + " \"$@\"\n",
                 true);
    folder.write("bf",
                 "#!/bin/sh\n" + find_here +
                     "export BLOCKFACTORY_PLUGIN_PATH=\"$here/lib/blockfactory\"\n"
                     "export YARP_DATA_DIRS=\"$here/share:$here/share/iCub\"\nexec \"$here/lib/" +
                     loader + "\" --library-path \"$here/lib\" \"$here/bin/bf\" \"$@\"\n",
                 true);
    folder.write(name + ".service", service(name, loaded.diagram, "--quiet --stop Inf"));
    return trial;
}

/// The generated program, cross-compiled and linked statically.
void pack_generated(const LoadedModel& loaded, const std::string& name, const std::string& target,
                    const OutputFolder& folder) {
    const std::string compiler = target + "-linux-gnu-g++";
    const auto project = folder.path() / "source", build = folder.path() / ".build";
    codegen::write(codegen::generate(loaded.diagram), project);
    const auto log = folder.path() / ".log";
    const std::string command =
        "{ cmake -S " + escape::shell(project.string()) + " -B " + escape::shell(build.string()) +
        " -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=" + target +
        " -DCMAKE_CXX_COMPILER=" + compiler + " -DCMAKE_EXE_LINKER_FLAGS=-static && cmake --build " +
        escape::shell(build.string()) + "; } >" + escape::shell(log.string()) + " 2>&1";
    const Waiting waiting("compiling for " + target);
    if (std::system(command.c_str()) != 0)
        throw CommandError("the generated program cannot be compiled for " + target + ":\n" +
                           read_text_file(log) + "install cmake and Debian's package g++-" +
                           (target == "x86_64" ? "x86-64" : target) + "-linux-gnu");
    folder.copy(build / ("run_" + codegen::file_name(loaded.diagram)), "bin/" + name);
    fs::remove_all(build);
    fs::remove(log);
    folder.write("run",
                 "#!/bin/sh\n# './run --help' tells more.\n" + find_here + "exec \"$here/bin/" + name +
                     "\" --realtime \"$@\"\n",
                 true);
    folder.write(name + ".service", service(name, loaded.diagram, "--stop Inf"));
}

void execute(const DeployOptions& options) {
    const LoadedModel loaded = load_model(options.model);
    if (const std::string why = not_for_real_time(loaded.diagram); !why.empty())
        throw CommandError("the package would run in real time: " + why);
    OutputFolder folder(options.folder);
    const std::string name = codegen::file_name(loaded.diagram);
    std::string how = "not checked, as it is for another machine";
    try {
        std::string hosted;
        for (const auto& block : codegen::hosted_blocks(loaded.diagram)) hosted += "\n  " + block;
        const bool is_foreign = options.target != machine();
        if (is_foreign && hosted.empty() && options.prefix.empty()) {
            pack_generated(loaded, name, options.target, folder);
        } else {
            fs::path prefix = options.prefix;
            if (is_foreign && prefix.empty())
                prefix = fs::read_symlink("/proc/self/exe").parent_path().parent_path() / options.target /
                         "prefix";
            auto program = this_program(*loaded.registry);
            if (!prefix.empty()) program = installed_program(prefix, options.target, program.plugins, hosted);
            const Trial trial = pack_program(program, loaded, options.model, name, folder);
            if (!is_foreign) how = tried(folder.path(), trial);
        }
        folder.commit();
    } catch (const fs::filesystem_error& error) {
        throw CommandError("cannot deploy: " + error.path1().string() + ": " +
                           write_error(error.code().value()));
    }
    std::uintmax_t bytes = 0;
    for (const auto& entry : fs::recursive_directory_iterator(options.folder))
        if (entry.is_regular_file()) bytes += entry.file_size();
    std::printf("%s (%s MB) for %s, %s; copy it to the robot and start it with: ./run\n",
                options.folder.c_str(), number(std::round(static_cast<double>(bytes) / 1e5) / 10).c_str(),
                options.target.c_str(), how.c_str());
}

} // namespace

void add_deploy(CLI::App& app) {
    auto* command = app.add_subcommand("deploy", "pack a folder that runs a model on a bare computer");
    auto options = std::make_shared<DeployOptions>();
    options->target = machine();
    options->model.add_to(*command);
    command->add_option("-o,--output", options->folder, "folder of the package; must be empty or not exist")
        ->type_name("DIR")
        ->required();
    command
        ->add_option("--target", options->target,
                     "x86_64 or aarch64; another machine than this one gets the generated program or, where "
                     "blocks come from plugins, what --prefix holds (this machine by default)")
        ->type_name("MACHINE")
        ->check(CLI::IsMember(std::set<std::string>{"x86_64", "aarch64"}).description(""));
    command
        ->add_option("--prefix", options->prefix,
                     "pack the program, the libraries and the model's plugins from this installation or "
                     "package for that machine (where 'make aarch64' installs by default)")
        ->type_name("DIR");
    command->footer("Examples:\n"
                    "  bf deploy examples/icub_balancing/balancing.yaml -o balancing\n"
                    "  bf deploy docs/start/motor.yaml --target aarch64 -o motor\n"
                    "  bf deploy examples/icub_balancing/balancing.yaml --target aarch64 -o balancing_arm");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
