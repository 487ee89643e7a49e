#include "bf/service/service.hpp"

#include "bf/base/files.hpp"
#include "bf/base/numbers.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/library/declared.hpp"
#include "bf/model/compare.hpp"
#include "bf/model/edit.hpp"
#include "bf/view/draw.hpp"
#include "bf/view/image.hpp"
#include "checker.hpp"
#include "clipboard.hpp"
#include "code.hpp"
#include "committed.hpp"
#include "edit_name.hpp"
#include "evaluate.hpp"
#include "files.hpp"
#include "find.hpp"
#include "images.hpp"
#include "inspect.hpp"
#include "json.hpp"
#include "live_model.hpp"
#include "messages.hpp"
#include "palette.hpp"
#include "places.hpp"
#include "placing.hpp"
#include "recorded_run.hpp"
#include "recordings.hpp"
#include "stage.hpp"
#include "typescript.hpp"

#include <cmath>
#include <map>
#include <optional>
#include <set>

namespace bf::service {

namespace fs = std::filesystem;

namespace {

/// What a request asks for and cannot have; the message goes to the page.
struct Refusal : std::runtime_error {
    using std::runtime_error::runtime_error;
};

} // namespace

struct Service::State {
    explicit State(Options o)
        : options(std::move(o)),
          shown(options.recording.empty()
                    ? nullptr
                    : std::make_unique<RecordedRun>(options.recording, options.file.empty())),
          folder(fs::absolute(first()).lexically_normal().parent_path()), alive(std::make_shared<bool>(true)),
          project(opened(first())) {
        if (!options.attach.empty()) attach();
        check();
    }

    std::string relative(const fs::path& file) const { return relative_to(folder, file); }

    // ---- the document ----

    const fs::path& first() const { return options.file.empty() ? shown->source().file : options.file; }
    std::unique_ptr<Project> opened(const fs::path& file) {
        return std::make_unique<Project>(
            file, &disk, [this] { post([this] { note_written(); }); },
            options.file.empty() ? Project::Texts(shown->source().texts) : std::nullopt);
    }

    /// Runs a task in the thread of the service, later, if the service is still there. For any thread.
    void post(std::function<void()> task) const {
        options.post([life = std::weak_ptr(alive), task = std::move(task)] {
            if (!life.expired()) task();
        });
    }

    /// Tells pages what became of the files; an answer to an edit waits for no disk.
    void note_written() {
        if (project->note_written()) tick();
        tell_changed();
    }

    void tick() {
        asking = 0;
        if (project->synchronise()) static_cast<void>(after_change());
    }

    void check() {
        checked_revision = -1;
        checker.check(
            project->as_read(),
            {project->file(), project->texts(), shown ? shown->source().overrides : ModelSource().overrides},
            [this, revision = project->revision(),
             of = project.get()](std::shared_ptr<const ExaminedModel> found) {
                post([this, revision, of, found = std::move(found)] {
                    if (of != project.get()) return;
                    examined = found;
                    if (shown && found->diagnostics.empty()) {
                        shown->name_signals(found->diagram);
                        options.tell(notification("run", to_json(shown->state())));
                    }
                    examined_revision = revision;
                    if (revision == project->revision()) checked_revision = revision;
                    tell_changed();
                    if (live_model && checked_revision == revision && found->diagnostics.empty())
                        live_model->consider({found, revision, edit_names.since(live_model->there()),
                                              last_page, project->moves()});
                    if (playback && checked_revision == revision && found->diagnostics.empty())
                        playback->edit(found, revision, edit_names.since(playback->revision()),
                                       project->moves());
                });
            });
    }

    DocumentState document() const {
        DocumentState state{.file = relative(project->file()), .revision = project->revision()};
        state.can_undo = project->can_undo();
        state.can_redo = project->can_redo();
        state.is_checked = checked_revision == project->revision();
        state.is_saved = project->is_saved();
        state.failure = project->failure();
        state.collision = project->collision();
        state.panels = panels();
        for (const auto& plot : project->model().plots) state.plots.push_back(plot.title);
        if (examined) state.diagnostics = told(examined->diagnostics);
        return state;
    }

    /// The model's plots as far as they are known, each as the layout has it, and what only the layout has.
    std::vector<PanelInfo> panels() const {
        std::vector<PanelInfo> all;
        const auto add = [&](std::string name, model::Shows shows, const auto& signals, bool is_kept) {
            const auto known = std::ranges::find(all, name, &PanelInfo::name);
            PanelInfo& panel = known != all.end() ? *known : all.emplace_back();
            panel = {std::move(name), shows, {}, is_kept};
            for (const auto& signal : signals) panel.signals.push_back(signal.path);
        };
        for (const auto& plot : diagram().plots) add(plot.title, model::Shows::lines, plot.signals, false);
        for (const auto& display : project->model().layout.displays)
            add(display.name, display.shows, display.signals, true);
        return all;
    }

    void tell_changed() { options.tell(notification("changed", to_json(document()))); }

    /// `edit` names it, where it goes on in a run.
    DocumentState after_change(std::vector<EditPart> edit = {{"edit"}}) {
        edit_names.add(project->revision(), std::move(edit));
        last_page = asking;
        check();
        tell_changed();
        if (playback) tell_run(playback->state(), playback->revision());
        return document();
    }

    const Diagram& diagram() const {
        static const Diagram nothing;
        return examined ? examined->diagram : nothing;
    }
    std::vector<model::Diagnostic> diagnostics() const {
        return examined ? examined->diagnostics : std::vector<model::Diagnostic>();
    }

    // ---- methods ----

    Welcome hello(int page, const Hello& asked) {
        if (asked.protocol != protocol_version)
            throw Refusal("this page speaks version " + std::to_string(asked.protocol) +
                          " of the protocol, and bf " + options.version + " version " +
                          std::to_string(protocol_version) + "; reload the page");
        return {options.version, files(),     page,
                document(),      run_state(), live ? std::optional(live->report()) : std::nullopt};
    }

    std::vector<std::string> files(const char* ending = ".yaml") const { return files_in(folder, ending); }

    fs::path folder_of(const std::string& system) const {
        return project->place_of(model::joined(system, "x")).first.parent_path();
    }
    fs::path inside(const std::string& name) const {
        const fs::path file = (folder / name).lexically_normal();
        if (!is_inside(file, folder))
            throw Refusal("the file '" + name +
                          "' is not in the opened folder; start bf edit with that folder");
        return file;
    }

    Times times(int page, const Look& asked) {
        if (asked.is_wanted)
            timers.insert(page);
        else
            timers.erase(page);
        return playback ? playback->times(!timers.empty()) : Times();
    }

    FileList models(int, const Nothing&) { return {files()}; }
    FileList recordings(int, const Nothing&) { return {files(".mcap")}; }
    RecordingNumber read(int page, const Open& asked) {
        return {recorded.read(page, inside(asked.file), asked.file)};
    }
    Nothing close(int, const RecordingNumber& asked) { return recorded.close(asked.number), Nothing(); }

    DocumentState open(int, const Open& asked) {
        const fs::path file = inside(asked.file);
        auto other = opened(file);
        if (const std::string lost = project->unsaved(); !lost.empty()) throw Refusal(lost);
        playback.reset();
        examined.reset();
        project = std::move(other);
        edit_names = {};
        return after_change();
    }

    LibraryList library(int, const Nothing&) {
        if (known_blocks.empty()) known_blocks = palette();
        return {known_blocks};
    }

    editor::Drawing draw(int, const Draw& asked) {
        editor::DrawOptions show = options_of(asked);
        show.folder = folder;
        return images.addressed(editor::draw(project->model(), asked.system, diagram(), diagnostics(), show));
    }

    TextFile picture(int page, const Draw& asked) {
        const std::string name = asked.system.empty() ? project->file().stem().string() : asked.system;
        return {name + ".svg", editor::to_svg(draw(page, asked), false)};
    }

    FileList image_files(int, const InSystem& asked) {
        const fs::path from = folder_of(asked.system);
        FileList all;
        for (const char* ending : {".png", ".svg"})
            for (const auto& file : files(ending))
                if (editor::image_defect(folder / file, folder).empty())
                    all.files.push_back((folder / file).lexically_relative(from).generic_string());
        return all;
    }

    ModelComparison compare(int, const Compare& asked) {
        const fs::path file = asked.file.empty() ? project->file() : inside(asked.file);
        const model::Model before = asked.file.empty() ? committed(file) : formats::read_yaml(file);
        const model::Model& after = project->model();
        const auto distinctions = model::compare(before, after);
        const std::string earlier = model::earlier_path(asked.system, distinctions);
        if (!editor::may_draw(before, earlier) && !editor::may_draw(after, asked.system))
            throw Refusal("there is no subsystem '" + asked.system + "' in either model");
        editor::Drawing left, right;
        if (editor::may_draw(before, earlier)) {
            const ExaminedModel known = examine(before, file);
            left = editor::draw(before, earlier, known.diagram, {});
        }
        if (editor::may_draw(after, asked.system)) right = editor::draw(after, asked.system, diagram(), {});
        ModelComparison found;
        found.drawing = images.addressed(editor::beside(left, right, distinctions,
                                                        asked.file.empty() ? "last commit" : asked.file,
                                                        relative(project->file())));
        for (const auto& d : distinctions) found.differences.push_back({d.path, d.system, model::text_of(d)});
        return found;
    }

    /// A new block, alone.
    editor::Element preview(int, const BlockType& asked) {
        model::Model alone;
        alone.root.blocks.push_back({.name = "new", .type = asked.type});
        if (const auto slash = asked.type.find('/'); slash != std::string::npos)
            alone.plugins.push_back({asked.type.substr(0, slash)});
        return editor::draw(alone, "", examine(alone, project->file()).diagram, {}).elements.front();
    }

    /// Edits, and as soon as one block of a subsystem gets a place gives the others those at which they are
    /// seen, so that nothing jumps.
    DocumentState apply(model::Operation operation, std::vector<EditPart> parts) {
        require_ports(project->model(), diagram(), operation);
        const std::set<std::string> systems = systems_placed_in(project->model(), operation);
        model::operations::Batch batch;
        for (const auto& system : systems)
            for (const auto& [path, at] : editor::unplaced(project->model(), system, diagram()))
                batch.operations.emplace_back(model::operations::Move{path, at});
        if (!batch.operations.empty()) {
            batch.operations.push_back(std::move(operation));
            operation = std::move(batch);
        }
        project->edit(operation);
        return after_change(std::move(parts));
    }

    DocumentState arrange(int, const InSystem& asked) {
        project->edit(editor::arranged(project->model(), asked.system, diagram()));
        return after_change();
    }

    Inspection inspect(int, const Inspect& asked) {
        return inspected(*registry, project->model(), diagram(), asked.path);
    }

    Parameters parameters(int, const Nothing&) {
        return parameters_of(*registry, project->model(), diagram());
    }

    Evaluated evaluate(int, const Evaluate& asked) {
        const model::Block* block = asked.path.empty() ? nullptr : model::find(project->model(), asked.path);
        if (asked.path.empty() || (block && block->system)) // its variables see each other
            return evaluated(project->model(), diagram(), asked.path, asked.text);
        if (block && block->is_library_block()) {
            const Declared what = declared(registry->find(block->type));
            for (const auto& a : what.arguments)
                if (a.name == asked.name && (a.type == "text" || !a.choices.empty())) return {};
        }
        return evaluated(project->model(), diagram(), model::split_last(asked.path).first, asked.text);
    }

    Hits find(int, const Find& asked) { return found_in(project->model(), asked.text); }

    Variables variables(int, const InSystem& asked) {
        return variables_seen_in(asked.system, project->model(), diagram(), diagnostics());
    }

    DocumentState edit(int, const Edit& asked) {
        return apply(model::operation_from_json(asked.operation.json),
                     parts_of(Json::parse(asked.operation.json)));
    }
    DocumentState undo(int, const Nothing&) {
        if (!project->undo()) throw Refusal("there is nothing to undo");
        return after_change({{"undo"}});
    }
    DocumentState redo(int, const Nothing&) {
        if (!project->redo()) throw Refusal("there is nothing to do again");
        return after_change({{"redo"}});
    }

    Text copy(int, const Copy& asked) { return {copied(project->model(), asked.system, asked.names)}; }
    DocumentState paste(int, const Paste& asked) {
        return apply(pasted(project->model(), asked.system, asked.text, folder_of(asked.system), asked.at),
                     {{"paste"}});
    }

    std::vector<Diagnostic> told(const std::vector<model::Diagnostic>& all) const {
        std::vector<Diagnostic> list;
        for (const auto& [where, path, message, remedy, fixes, is_open, variable] : all)
            list.push_back({where.file ? relative(*where.file) : "", where.line, where.column, path, message,
                            remedy, fixes, is_open});
        return list;
    }

    FileText text(int, const InSystem& asked) {
        const auto [file, local] = project->place_of(model::joined(asked.system, "x"));
        FileText found{relative(file), project->text_in(file)};
        formats::Files texts = project->texts();
        texts[file] = found.text;
        std::string outer = asked.system; // the block that stands for the file, if one does
        outer.resize(outer.size() - model::split_last(local).first.size());
        if (outer.ends_with('.')) outer.pop_back();
        try {
            found.places = places_in(formats::read_yaml(file, texts), outer);
        } catch (const model::Errors& errors) {
            found.diagnostics = told(errors.diagnostics());
        }
        return found;
    }
    Rewritten rewrite(int, const Rewrite& asked) {
        try {
            if (!project->rewrite(inside(asked.file), asked.before, asked.text)) return {document(), true};
        } catch (const model::Errors& errors) {
            return {document(), false, told(errors.diagnostics())};
        }
        return {after_change({{"text"}})};
    }

    GeneratedCode generate(int, const Generate& asked) {
        require_runnable();
        return generated(*examined, asked.language);
    }

    // ---- the run ----

    RunState run_state() const {
        if (live) return live_model->seen(live->state(), project->revision());
        if (shown) return shown->state();
        if (!playback) return {};
        RunState state = playback->state();
        state.is_current = playback->revision() == project->revision();
        return state;
    }
    void tell_run(RunState state, std::int64_t revision) {
        state.is_current = revision == project->revision();
        options.tell(notification("run", to_json(state)));
        if (playback && playback->model() != std::exchange(played, playback->model()))
            stage.follow(played, playback.get());
    }

    void require_runnable() const {
        if (checked_revision != project->revision())
            throw Refusal("the model is being checked; try again in a moment");
        if (!examined->diagnostics.empty())
            throw Refusal("the model has mistakes: " + examined->diagnostics.front().text());
    }

    void begin_run() {
        require_runnable();
        playback = std::make_unique<Playback>(
            examined, project->revision(),
            Playback::Listener{[this](RunState state, std::int64_t revision) {
                                   post([this, revision, state = std::move(state)] {
                                       tell_run(state, revision);
                                   });
                               },
                               [this](std::string frame) {
                                   post([this, frame = std::move(frame)] { options.send(frame); });
                               }});
        played = playback->model();
        stage.follow(played, playback.get());
        rewatch();
    }

    Scene scene(int page, const Look& asked) {
        const bool is_right = examined && examined->diagnostics.empty();
        const std::shared_ptr<const LoadedModel> model = playback   ? playback->model()
                                                         : is_right ? examined
                                                                    : nullptr;
        Scene found = stage.look(page, asked.is_wanted, model, playback.get());
        if (!shown) return found;
        if (std::string missing = shown->show(stage.seen()); !missing.empty()) found.failure = missing;
        post([this] { options.send(shown->places()); }); // after the answer, which pages clear places with
        return found;
    }

    /// The run is that of another program. What its connection finds out comes to the thread of the service.
    void attach() {
        const auto here = [this](auto then) {
            return [this, then](auto what) { post([then, what = std::move(what)] { then(what); }); };
        };
        live = std::make_unique<Live>(
            options.attach, Live::Listener{here([this](const RunState& state) {
                                               if (!live_model) return;
                                               const bool is_there = state.state == Running::running;
                                               if (!std::exchange(is_connected, is_there) && is_there)
                                                   live_model->go_on();
                                               tell_live(state);
                                               const int told = live->advertised();
                                               if (told != std::exchange(live_signals, told)) rewatch();
                                           }),
                                           here([this](const LiveReport& report) {
                                               options.tell(notification("live", to_json(report)));
                                           }),
                                           here([this](const std::string& frame) { options.send(frame); })});
        live_model.emplace(
            *live, project->revision(), [this](auto task) { post(std::move(task)); },
            [this] { tell_live(live->state()); });
    }
    void tell_live(const RunState& state) {
        options.tell(notification("run", to_json(live_model->seen(state, project->revision()))));
    }
    RunState run(int page, const RunCommand& asked) {
        if (live) {
            if (asked.action != Action::start && asked.action != Action::stop &&
                asked.action != Action::emergency_stop && asked.action != Action::adopt)
                throw Refusal("the run is another program's: it cannot be moved in time");
            live_model->require_control();
            if (asked.action == Action::adopt)
                live_model->adopt(page);
            else
                live->command(asked.action, page);
            return run_state();
        }
        if (asked.action == Action::emergency_stop)
            throw Refusal("only the run of another program has an emergency stop");
        if (asked.factor && !(*asked.factor > 0)) throw Refusal("'factor' takes a number greater than 0");
        if (asked.time && !(*asked.time >= 0)) throw Refusal("'time' takes a number that is not negative");
        if (shown) {
            if (asked.action != Action::to || !asked.time) throw Refusal(shown->state().recorded);
            shown->look_at(*asked.time);
            options.send(shown->places());
            return run_state();
        }
        if (!playback) {
            if (asked.action == Action::stop || asked.action == Action::pause) {
                options.tell(notification("run", to_json(RunState())));
                return {};
            }
            begin_run();
        } else if (asked.action == Action::start && playback->revision() != project->revision()) {
            const RunState state = playback->state();
            if (state.state == Running::ended || state.state == Running::failed || state.time == 0)
                require_runnable(); // it begins anew
        }
        playback->command(asked);
        return run_state();
    }

    Signals signals(int, const Nothing&) {
        Signals all;
        all.signals = run_signals();
        for (const auto& panel : diagram().plots) {
            all.plots.push_back({panel.title, {}});
            for (const auto& signal : panel.signals) all.plots.back().signals.push_back(signal.path);
        }
        return all;
    }

    Signals watch(int page, const Watch& asked) {
        wishes[page].first = asked;
        Signals found{rewatch(page), {}};
        if (live || shown || playback)
            for (const auto& path : asked.paths)
                if (std::ranges::find(found.signals, path, &SignalInfo::path) == found.signals.end())
                    found.unknown.push_back(path);
        return found;
    }

    std::vector<SignalInfo> run_signals() const {
        return live       ? live->signals()
               : shown    ? shown->signals()
               : playback ? playback->signals()
                          : std::vector<SignalInfo>();
    }

    /// What pages wish, of this run. Returns what `page` gets.
    std::vector<SignalInfo> rewatch(int page = -1) {
        std::vector<SignalInfo> own;
        const std::vector<SignalInfo> signals = run_signals();
        std::multimap<std::string_view, const SignalInfo*> by_path; // edits change sizes
        for (const auto& signal : signals) by_path.emplace(signal.path, &signal);
        std::set<int> all, branches, missing; // what a page has nothing of, since it came later than others
        for (auto& [wisher, wish] : wishes) {
            auto& [asked, sent] = wish;
            branches.insert(asked.branches.begin(), asked.branches.end());
            for (const auto& path : asked.paths)
                for (auto [at, end] = by_path.equal_range(path); at != end; ++at) {
                    all.insert(at->second->index);
                    if (sent.insert(at->second->index).second) missing.insert(at->second->index);
                    if (wisher == page) own.push_back(*at->second);
                }
        }
        if (live) live->watch({all.begin(), all.end()});
        if (shown) options.send(shown->samples(missing));
        if (playback) playback->watch({all.begin(), all.end()}, {branches.begin(), branches.end()}, missing);
        return own;
    }

    Nothing refine(int, const Refine& asked) {
        if (playback) playback->refine(asked.from, asked.to);
        return {};
    }

    RunState tune(int page, const Tune& asked) {
        if (live) {
            live_model->require_control();
            live->tune(asked, page);
            return run_state();
        }
        if (shown) throw Refusal(shown->state().recorded);
        if (!playback) throw Refusal("nothing runs; start a run, or change the model");
        playback->tune(asked);
        return run_state();
    }

    const Options options;
    const std::unique_ptr<RecordedRun> shown; ///< where there is a recording in place of a run
    const fs::path folder;
    std::shared_ptr<bool> alive; ///< asked by tasks that come back from other threads
    Worker disk;
    std::unique_ptr<Project> project;
    std::shared_ptr<const ExaminedModel> examined;
    std::int64_t examined_revision = -1, checked_revision = -1;
    EditNames edit_names;
    int last_page = 0, asking = 0; ///< who made it; the page whose request is answered; 0: none
    const std::unique_ptr<Registry> registry = make_registry();
    std::vector<LibraryBlock> known_blocks;
    std::map<int, std::pair<Watch, std::set<int>>> wishes; ///< by page; signals of which it was sent all
    std::unique_ptr<Playback> playback;
    std::unique_ptr<Live> live; ///< where the run is another program's
    std::optional<LiveModel> live_model;
    int live_signals = 0;
    bool is_connected = false; ///< to that program
    std::shared_ptr<const LoadedModel> played;
    Stage stage{options.sceneries};
    Recordings recorded{
        [this](auto task) { post(std::move(task)); },
        [this](const Recorded& what) { options.tell(notification("recorded", to_json(what))); }};
    Images images{folder};
    std::set<int> timers; ///< pages that want to know the time of blocks
    Checker checker;      ///< last: its thread ends first
};

Service::Service(Options options) : state_(std::make_unique<State>(std::move(options))) {}
Service::~Service() = default;

void Service::leave(int page) {
    state_->wishes.erase(page);
    state_->stage.leave(page);
    state_->recorded.leave(page);
    if (state_->timers.contains(page)) static_cast<void>(state_->times(page, {.is_wanted = false}));
    state_->stage.follow(state_->played, state_->playback.get());
    state_->rewatch();
}

std::optional<std::string> Service::data(std::string_view what) const {
    const auto slash = std::min(what.find('/'), what.size() - 1);
    const std::string_view kind = what.substr(0, slash), which = what.substr(slash + 1);
    if (kind == "meshes") return state_->stage.meshes(which);
    if (kind == "recordings") return state_->recorded.samples(which);
    if (kind == "images") return state_->images.read(which);
    return {};
}

void Service::tick() { state_->tick(); }
std::string Service::unsaved() { return state_->project->unsaved(); }

namespace {

/// A method of the protocol: how it is called, and what it takes and gives, for the page.
struct Method {
    std::string name;
    std::function<Json(Service::State&, int page, const Json& params)> call;
    std::string params, result; ///< in TypeScript
    std::map<std::string, std::string> types;
};

template <class Params, class Result>
Method method(const char* name, Result (Service::State::*call)(int, const Params&)) {
    Method made{name,
                [call](Service::State& state, int page, const Json& json) {
                    Params params{};
                    from_json(json, params);
                    return to_json((state.*call)(page, params));
                },
                {},
                {},
                {}};
    made.params = typescript_of<Params>(made.types);
    made.result = typescript_of<Result>(made.types);
    return made;
}

const std::vector<Method>& methods() {
    using S = Service::State;
    static const std::vector<Method> all = {
        method("hello", &S::hello),       method("open", &S::open),
        method("library", &S::library),   method("draw", &S::draw),
        method("inspect", &S::inspect),   method("find", &S::find),
        method("evaluate", &S::evaluate), method("variables", &S::variables),
        method("edit", &S::edit),         method("undo", &S::undo),
        method("redo", &S::redo),         method("arrange", &S::arrange),
        method("copy", &S::copy),         method("paste", &S::paste),
        method("text", &S::text),         method("rewrite", &S::rewrite),
        method("preview", &S::preview),   method("run", &S::run),
        method("signals", &S::signals),   method("scene", &S::scene),
        method("times", &S::times),       method("recordings", &S::recordings),
        method("read", &S::read),         method("watch", &S::watch),
        method("tune", &S::tune),         method("images", &S::image_files),
        method("compare", &S::compare),   method("parameters", &S::parameters),
        method("generate", &S::generate), method("models", &S::models),
        method("picture", &S::picture),   method("refine", &S::refine),
        method("close", &S::close)};
    return all;
}

} // namespace

std::string Service::typescript() {
    std::map<std::string, std::string> types;
    std::string table;
    for (const auto& method : methods()) {
        types.insert(method.types.begin(), method.types.end());
        table += "  " + method.name + ": { params: " + method.params + "; result: " + method.result + " };\n";
    }
    return typescript_protocol(std::move(types), table);
}

std::string Service::answer(int page, std::string_view request) {
    constexpr int deepest = 1000; // a hundred subsystems
    if (depth_of(request) > deepest) return error_text({}, Code::request, "the request is nested too deeply");
    const Json json = Json::parse(request, nullptr, false);
    if (json.is_discarded()) return error_text({}, Code::parse, "this is no JSON");
    if (!json.is_object()) return error_text({}, Code::request, "a request is a JSON object");
    const Json id =
        json.contains("id") && (json["id"].is_number() || json["id"].is_string()) ? json["id"] : Json();
    if (!json.contains("method") || !json["method"].is_string())
        return error_text(id, Code::request, "a request has a method");
    const auto name = json["method"].get<std::string>();
    const auto found = std::ranges::find(methods(), name, &Method::name);
    if (found == methods().end()) return error_text(id, Code::method, "there is no method '" + name + "'");
    state_->asking = page;
    try {
        const Json result =
            found->call(*state_, page, json.contains("params") ? json["params"] : Json::object());
        return Json{{"jsonrpc", "2.0"}, {"id", id}, {"result", result}}.dump(-1, ' ', false,
                                                                             Json::error_handler_t::replace);
    } catch (const ProtocolError& error) {
        return error_text(id, Code::params, name + ": " + error.what());
    } catch (const std::exception& error) {
        return error_text(id, Code::refused, error.what());
    }
}

} // namespace bf::service
