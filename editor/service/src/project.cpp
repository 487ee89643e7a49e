#include "bf/service/project.hpp"

#include "bf/base/files.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/check.hpp"
#include "bf/model/edit.hpp"
#include "disk.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace bf::service {

namespace fs = std::filesystem;

namespace {

template <class Visit> void each_reference(model::System& system, const Visit& visit) {
    for (auto& block : system.blocks) {
        if (block.reference) visit(*block.reference);
        if (block.system) each_reference(*block.system, visit);
    }
}

bool has_references(const model::System& system) {
    return std::ranges::any_of(system.blocks, [](const model::Block& block) {
        return block.reference || (block.system && has_references(*block.system));
    });
}

/// Puts the content of files in the places that refer to them, and tells which file stands where.
void expand(model::System& system, const fs::path& folder, const std::string& prefix,
            std::vector<std::pair<std::string, fs::path>>& places) {
    for (auto& block : system.blocks) {
        const std::string path = prefix + block.name;
        fs::path inner = folder;
        if (block.reference && block.reference->model) {
            const fs::path file = (folder / block.reference->file).lexically_normal();
            places.emplace_back(path, file);
            inner = file.parent_path();
            block.system = model::OwnSystem(std::make_unique<model::System>(block.reference->model->root));
            block.reference.reset();
        }
        if (block.system) expand(*block.system, inner, path + ".", places);
    }
}

/// Undoes `expand`, where nothing but names under references have changed.
void collapse(model::System& system, const model::System& before) {
    for (std::size_t i = 0; i < system.blocks.size(); ++i) {
        model::Block& block = system.blocks[i];
        if (before.blocks[i].reference) {
            block.system = {};
            block.reference = before.blocks[i].reference;
        } else if (block.system) {
            collapse(*block.system, *before.blocks[i].system);
        }
    }
}

std::set<std::string> texts_of(const std::vector<model::Diagnostic>& diagnostics) {
    std::set<std::string> all;
    for (const auto& d : diagnostics) all.insert(d.text());
    return all;
}

} // namespace

struct Project::Document {
    fs::path file;
    model::Model model;
    model::History history;
    formats::Rewriter writer;
    std::string text;                         ///< of the model
    std::shared_ptr<const model::Model> read; ///< from the text, without files
    std::string written;                      ///< text of the file as it is known here
    Stamp stamp;
    bool is_missing = false;    ///< is there no such file?
    bool is_on_the_way = false; ///< is a text being written?
    /// What was done since that text, in order; nothing stands for what cannot be done again on another one.
    std::vector<std::optional<model::Operation>> waiting;
    std::size_t sent = 0;               ///< of these are in the text that is being written
    std::optional<std::string> foreign; ///< what another program has written into the file and is no model
    std::string failure;
    std::shared_ptr<const model::Model> shared; ///< the model, for those that refer to it
};

Project::Project(const fs::path& file, Worker* disk, std::function<void()> written, Texts texts)
    : disk_(std::make_unique<Disk>(disk, std::move(written), std::move(texts))) {
    open(fs::absolute(file).lexically_normal());
    for (const auto& document : documents_) disk_->clean(document->file);
    link_all();
}

Project::~Project() { static_cast<void>(unsaved()); }

std::string Project::unsaved() {
    settle();
    for (int tries = 0; tries < 3 && !is_saved(); ++tries, settle()) // another program was faster
        static_cast<void>(synchronise());
    std::string all;
    for (const auto& d : documents_)
        if (d->text != d->written)
            all += (all.empty() ? "" : "; ") + d->file.string() + " is without the last edits: " + d->failure;
    return all;
}

const fs::path& Project::file() const { return documents_.front()->file; }
const model::Model& Project::model() const { return documents_.front()->model; }

Project::Document* Project::find(const fs::path& file) const {
    const auto found = std::ranges::find(documents_, file, [](const auto& d) { return d->file; });
    return found == documents_.end() ? nullptr : found->get();
}

Project::Document& Project::open(const fs::path& file) {
    if (Document* document = find(file)) return *document;
    auto made = std::make_unique<Document>();
    made->file = file;
    made->stamp = disk_->stamp(file);
    formats::Files texts = disk_->texts();
    made->model = formats::read_yaml(file, texts);
    made->text = made->written = texts.at(file);
    made->read = std::make_shared<const model::Model>(made->model);
    documents_.push_back(std::move(made));
    Document& document = *documents_.back();
    each_reference(document.model.root, [&](model::Reference& reference) {
        open((file.parent_path() / reference.file).lexically_normal());
    });
    return document;
}

/// Puts the model into its file.
void Project::save(Document& document) {
    formats::Rewriter::Written written = document.writer.write(document.model);
    document.text = std::move(written.text);
    document.read = std::move(written.model);
    put(document);
}

/// Puts the text into its file, where the file holds another one. What comes while one is on its way follows
/// it.
void Project::put(Document& document) {
    if (document.is_on_the_way) return;
    if (document.text == document.written && !document.is_missing) {
        document.failure.clear();
        document.waiting.clear();
        return;
    }
    document.is_on_the_way = true;
    document.sent = document.waiting.size();
    disk_->write(
        {document.file, document.text, document.is_missing ? std::nullopt : std::optional(document.written)});
    note_written(); // without a worker it is done
}

bool Project::note_written() {
    bool is_foreign = false;
    for (auto& done : disk_->take()) {
        Document* const document = find(done.file);
        if (!document) continue;
        document->is_on_the_way = false;
        is_foreign |= done.is_foreign;
        if (done.failure.empty()) document->stamp = {}; // whatever is there is looked at
        if (done.is_foreign) continue;
        document->failure = done.failure;
        if (!done.failure.empty()) continue;
        document->written = std::move(done.text);
        document->is_missing = false;
        document->waiting.erase(document->waiting.begin(),
                                document->waiting.begin() + static_cast<std::ptrdiff_t>(document->sent));
        put(*document);
    }
    return is_foreign;
}

void Project::settle() {
    while (std::ranges::any_of(documents_, [](const auto& d) { return d->is_on_the_way; })) {
        disk_->wait();
        note_written();
    }
}

bool Project::is_saved() const {
    return std::ranges::all_of(documents_, [](const auto& d) { return d->text == d->written; });
}

/// Gives the document's references what the files hold now. Files refer to each other without circles, which
/// their reader refuses.
void Project::link(Document& document) {
    each_reference(document.model.root, [&](model::Reference& reference) {
        reference.model = shared(open((document.file.parent_path() / reference.file).lexically_normal()));
    });
}

std::shared_ptr<const model::Model> Project::shared(Document& document) {
    if (!document.shared) {
        link(document);
        document.shared = std::make_shared<const model::Model>(document.model);
    }
    return document.shared;
}

void Project::link_all() {
    for (const auto& document : documents_) document->shared = nullptr;
    for (std::size_t i = 0; i < documents_.size(); ++i) link(*documents_[i]); // linking may open more
}

/// The paths of all blocks that stand for the document; empty is that of the opened one.
std::vector<std::string> Project::places_of(const Document& document) const {
    std::vector<std::string> places;
    const auto look = [&](const auto& self, const model::System& system, const fs::path& file,
                          const std::string& path) -> void {
        if (file == document.file) return places.push_back(path); // it does not refer to itself
        for (const auto& block : system.blocks) {
            if (!block.content()) continue;
            const fs::path inner =
                block.reference ? (file.parent_path() / block.reference->file).lexically_normal() : file;
            self(self, *block.content(), inner, model::joined(path, block.name));
        }
    };
    look(look, model().root, this->file(), "");
    return places;
}

/// These, and perhaps others of which no block got another path.
void Project::changed(const std::vector<Document*>& documents) {
    ++revision_;
    for (const Document* document : documents) {
        std::optional<std::vector<model::Moved>> moved = document->history.moved();
        if (moved && !moved->empty()) {
            const std::vector<model::Moved> own = std::move(*moved);
            moved->clear();
            for (const auto& place : places_of(*document))
                for (const auto& [from, to] : own)
                    moved->push_back({model::joined(place, from), model::joined(place, to)});
        }
        moves_.add(revision_, std::move(moved));
    }
}

/// Follows the path through files; afterwards it is the path in the document.
Project::Document& Project::document_of(std::string& path) const {
    Document* document = documents_.front().get();
    for (std::size_t dot = path.find('.'); dot != path.npos; dot = path.find('.', dot + 1)) {
        const model::Block* block = model::find(std::as_const(document->model), path.substr(0, dot));
        if (!block) break;
        if (!block->reference) continue;
        const fs::path file = (document->file.parent_path() / block->reference->file).lexically_normal();
        Document* const found = find(file);
        if (!found) break;
        document = found;
        path.erase(0, dot + 1);
        dot = static_cast<std::size_t>(-1);
    }
    return *document;
}

std::pair<fs::path, std::string> Project::place_of(const std::string& path) const {
    std::string local = path;
    const Document& document = document_of(local);
    return {document.file, local};
}

/// The operation on the document that it concerns, with the paths there. Operations of a batch concern one
/// document.
model::Operation Project::localised(model::Operation operation, Document*& document) const {
    const auto concern = [&](Document& other, const std::string& path) {
        if (document && document != &other)
            throw model::Errors(
                {{{}, path, "these changes concern several files", "make them one file at a time"}});
        document = &other;
    };
    // A path in a system is found by a name in it, whatever that is.
    const auto in_system = [&](std::string& system) {
        std::string path = system.empty() ? "x" : system + ".x";
        const std::string asked = system;
        concern(document_of(path), asked);
        system = path.size() < 2 ? "" : path.substr(0, path.size() - 2);
    };
    std::visit(
        [&]<class T>(T& change) {
            if constexpr (std::is_same_v<T, model::operations::Batch>) {
                for (auto& part : change.operations) part = localised(std::move(part), document);
            } else if constexpr (std::is_same_v<T, model::operations::Annotate>) {
                std::string root;
                in_system(change.note ? change.note->system : root);
            } else if constexpr (std::is_same_v<T, model::operations::Record> ||
                                 std::is_same_v<T, model::operations::Plot> ||
                                 std::is_same_v<T, model::operations::Watch> ||
                                 std::is_same_v<T, model::operations::Patch>) {
                concern(*documents_.front(), ""); // signals are named from the opened model on
            } else if constexpr (std::is_same_v<T, model::operations::Bend> ||
                                 std::is_same_v<T, model::operations::Label>) {
                // A wire to a block in another file stands in the file around it.
                const std::vector<std::string> systems = model::systems_with_wire(model(), change.path);
                std::string system = systems.empty() ? model::split_last(change.path).first : systems.front();
                const std::string end = system.empty() ? change.path : change.path.substr(system.size() + 1);
                in_system(system);
                change.path = model::joined(system, end);
            } else if constexpr (requires { change.system; }) {
                in_system(change.system);
            } else {
                const std::string asked = change.path;
                concern(document_of(change.path), asked);
            }
        },
        operation);
    return operation;
}

/// Files of the folder that refer to this one take part in the project from now on.
void Project::open_referring(const fs::path& file) {
    const fs::path folder = documents_.front()->file.parent_path();
    constexpr int deepest = 6;
    std::error_code error;
    std::vector<fs::path> found;
    for (auto at =
             fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied, error);
         !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
        const std::string name = at->path().filename().string();
        if (at->is_directory(error) && (at.depth() >= deepest || name.starts_with(".") || name == "build"))
            at.disable_recursion_pending();
        if (at->path().extension() == ".yaml" && at->is_regular_file(error))
            found.push_back(at->path().lexically_normal());
    }
    std::sort(found.begin(), found.end());
    std::set<fs::path> concerned{file}; // and what refers to it, by way of others too
    const auto concerns = [&](Document& document) {
        bool refers = false;
        each_reference(document.model.root, [&](const model::Reference& reference) {
            refers |= concerned.contains((document.file.parent_path() / reference.file).lexically_normal());
        });
        return refers;
    };
    for (bool is_more = true; std::exchange(is_more, false);) {
        for (const auto& document : documents_)
            if (!concerned.contains(document->file) && concerns(*document))
                is_more = concerned.insert(document->file).second;
        for (const auto& other : found) {
            if (find(other)) continue;
            const std::size_t count = documents_.size();
            bool refers = false;
            try {
                const std::string text = read_text_file(other);
                if (std::ranges::any_of(concerned, [&](const fs::path& known) {
                        return text.find(known.filename().string()) != std::string::npos;
                    }))
                    refers = concerns(open(other));
            } catch (const std::exception&) { // it is no model
            }
            if (!refers) documents_.resize(count);
            is_more |= refers;
        }
    }
    link_all();
}

/// What other files become when something of this one gets another name.
std::vector<std::pair<Project::Document*, model::Model>> Project::followed(
    const Document& document, const model::operations::Rename& rename) {
    std::vector<std::pair<Document*, model::Model>> all;
    for (const auto& other : documents_) {
        if (other.get() == &document) continue;
        model::Model model = other->model;
        std::vector<std::pair<std::string, fs::path>> places;
        expand(model.root, other->file.parent_path(), "", places);
        std::erase_if(places, [&](const auto& place) { return place.second != document.file; });
        for (const auto& [path, file] : places)
            model::edit(model, model::operations::Rename{path + "." + rename.path, rename.name});
        collapse(model.root, other->model.root);
        if (!model::difference(other->model, model).changes.empty())
            all.emplace_back(other.get(), std::move(model));
    }
    return all;
}

/// Variables of a file are given values by those who refer to it.
std::vector<std::pair<Project::Document*, model::Model>> Project::followed(
    const Document& document, const model::operations::RenameVariable& rename) {
    std::vector<std::pair<Document*, model::Model>> all;
    if (!rename.system.empty()) return all;
    for (const auto& other : documents_) {
        model::Model model = other->model;
        bool is_concerned = false;
        each_reference(model.root, [&](model::Reference& reference) {
            if ((other->file.parent_path() / reference.file).lexically_normal() != document.file) return;
            for (model::Variable& given : reference.with)
                if (given.name == rename.name) {
                    given.name = rename.to;
                    is_concerned = true;
                }
        });
        if (is_concerned) all.emplace_back(other.get(), std::move(model));
    }
    return all;
}

/// The file of an undone `extract` goes with it, unless somebody has written something else into it, or
/// another file of the folder refers to it by now.
void Project::take_away(Document& made) {
    settle();
    open_referring(made.file);
    bool is_used = false;
    for (const auto& other : documents_)
        each_reference(other->model.root, [&](const model::Reference& reference) {
            is_used |= (other->file.parent_path() / reference.file).lexically_normal() == made.file;
        });
    const auto found = std::ranges::find(documents_, &made, &std::unique_ptr<Document>::get);
    if (is_used || found == documents_.end()) return;
    try {
        if (!made.foreign && read_text_file(made.file) == made.written) fs::remove(made.file);
    } catch (const std::exception&) { // it is gone, or stays
    }
    taken_away_.push_back(std::move(*found));
    documents_.erase(found);
}

void Project::put_back(Document& made) {
    const auto found = std::ranges::find(taken_away_, &made, &std::unique_ptr<Document>::get);
    if (found == taken_away_.end()) return;
    if (fs::exists(made.file))
        throw model::Errors({{{}, "", "'" + made.file.string() + "' exists", "remove or rename it first"}});
    made.written.clear();
    made.is_missing = true;
    documents_.push_back(std::move(*found));
    taken_away_.erase(found);
    save(made);
}

/// What another program wrote is never written over, also where it is no model.
void Project::require_own(const Document& document) {
    if (document.foreign)
        throw model::Errors({{{},
                              "",
                              "another program has written into the file: " + document.failure,
                              "mend the file first"}});
}

/// What is wrong in the files that refer to this one, without what is known.
std::vector<model::Diagnostic> Project::mistakes_beside(const Document& document,
                                                        const std::set<std::string>& known) const {
    std::vector<model::Diagnostic> all;
    for (const auto& other : documents_)
        if (other.get() != &document)
            for (auto& d : model::check(other->model))
                if (!known.contains(d.text())) all.push_back(std::move(d));
    return all;
}

void Project::require_inside(const fs::path& file) const {
    if (!is_inside(file, documents_.front()->file.parent_path()))
        throw model::Errors(
            {{{},
              "",
              "the file '" + file.string() + "' lies outside of the folder of the opened model",
              "open it by itself"}});
}

void Project::edit(const model::Operation& operation) {
    collision_.clear();
    static_cast<void>(synchronise()); // an edit is of what is there
    Document* document = nullptr;
    const model::Operation local = localised(operation, document);
    if (document) apply(*document, local); // it is no empty batch
}

/// An operation with paths of the document.
void Project::apply(Document& document, const model::Operation& local) {
    const auto* const extract = std::get_if<model::operations::Extract>(&local);
    require_inside(document.file);
    require_own(document);
    const auto beside = [&](const std::string& file) {
        return (document.file.parent_path() / file).lexically_normal();
    };
    const bool makes_file = extract && !extract->file.empty(); // without a name it is refused below
    if (makes_file) require_inside(beside(extract->file));
    std::vector<std::pair<Document*, model::Model>> others;
    const auto follow = [&](const auto* rename) {
        if (!rename) return;
        open_referring(document.file);
        others = followed(document, *rename);
        for (const auto& [other, model] : others) {
            require_inside(other->file);
            require_own(*other);
        }
    };
    follow(std::get_if<model::operations::Rename>(&local));
    follow(std::get_if<model::operations::RenameVariable>(&local));
    if (makes_file && fs::exists(beside(extract->file)))
        throw model::Errors(
            {{{}, extract->path, "the file '" + extract->file + "' exists", "give another name"}});
    const std::set<std::string> known = texts_of(mistakes_beside(document));
    const auto read = [&](const std::string& name) { return shared(open(beside(name))); };
    if (!document.history.edit(document.model, local, read)) return;
    for (auto& [other, model] : others) other->history.replace(other->model, std::move(model));
    const auto take_back = [&] {
        document.history.undo(document.model);
        for (auto& [other, model] : others) other->history.undo(other->model);
        link_all();
    };
    Step step{{&document}};
    if (extract) { // the content becomes a file of its own
        auto made = std::make_unique<Document>();
        made->file = beside(extract->file);
        made->is_missing = true;
        made->model = *model::find(std::as_const(document.model), extract->path)->reference->model;
        step.made = made.get();
        documents_.push_back(std::move(made));
        save(*step.made);
        settle(); // before the content goes from where it was
        if (const std::string failure = step.made->failure; step.made->text != step.made->written) {
            documents_.pop_back();
            take_back();
            if (!failure.empty())
                throw model::Errors({{{}, extract->path, failure, "give a place that can be written"}});
            throw model::Errors({{{},
                                  extract->path,
                                  "another program has written the file '" + extract->file + "' meanwhile",
                                  "give another name"}});
        }
    }
    link_all();
    std::vector<model::Diagnostic> broken = mistakes_beside(document, known);
    if (!broken.empty()) {
        take_back();
        throw model::Errors(std::move(broken));
    }
    document.waiting.emplace_back(local);
    for (const auto& [other, model] : others) {
        step.changed.push_back(other);
        other->waiting.emplace_back();
    }
    done_.push_back(step);
    undone_.clear();
    changed({&document});
    for (Document* changed : step.changed) save(*changed);
}

bool Project::step(std::vector<Step>& from, std::vector<Step>& to,
                   bool (model::History::*move)(model::Model&)) {
    collision_.clear();
    static_cast<void>(synchronise());
    if (from.empty()) return false;
    const Step step = from.back();
    for (const Document* document : step.changed) require_own(*document);
    if (step.made && &from == &undone_) put_back(*step.made);
    for (Document* document : step.changed) {
        (document->history.*move)(document->model);
        document->waiting.emplace_back();
    }
    to.push_back(step);
    from.pop_back();
    if (step.made && &from == &done_) take_away(*step.made);
    link_all();
    changed(step.changed);
    for (Document* document : step.changed) save(*document);
    return true;
}

/// The model that was read from another text takes the place of the document's, as an edit.
void Project::take(Document& document, model::Model model, const std::string& text) {
    document.history.replace(document.model, std::move(model));
    document.text = text;
    document.read = std::make_shared<const model::Model>(document.model);
    done_.push_back({{&document}});
    undone_.clear();
    link_all();
    changed({&document});
}

bool Project::rewrite(const fs::path& file, const std::string& before, const std::string& text) {
    collision_.clear();
    static_cast<void>(synchronise());
    Document* const found = find(file);
    if (!found)
        throw model::Errors({{{}, "", "the model has no file '" + file.string() + "'", "open it by itself"}});
    Document& document = *found;
    require_inside(file);
    if (document.foreign.value_or(document.text) != before) return false;
    if (text == before) return true;
    formats::Files texts{{file, text}};
    model::Model model = formats::read_yaml(file, texts);
    const std::set<std::string> known = texts_of(mistakes_beside(document));
    std::swap(document.model, model);
    link_all();
    std::vector<model::Diagnostic> broken = mistakes_beside(document, known);
    std::swap(document.model, model);
    link_all();
    if (!broken.empty()) throw model::Errors(std::move(broken));
    take(document, std::move(model), text);
    if (document.foreign) document.written = *std::exchange(document.foreign, {});
    document.waiting.emplace_back();
    save(document);
    return true;
}

bool Project::synchronise() {
    bool is_other = false;
    for (std::size_t i = 0; i < documents_.size(); ++i) {
        Document& document = *documents_[i];
        if (document.is_on_the_way) continue; // whoever writes it looks
        const std::string failure = document.failure;
        is_other |= look(document);
        if (!document.foreign && document.text != document.written) put(document); // again
        is_other |= document.failure != failure;
    }
    return is_other;
}

/// Reads the file where it may have changed; true when that changed the model.
bool Project::look(Document& document) {
    const Stamp now = disk_->stamp(document.file);
    if (document.stamp == now) return false;
    document.stamp = now;
    std::string text;
    try {
        text = disk_->read(document.file);
    } catch (const FileError& error) {
        document.is_missing = now.size < 0;
        document.failure = error.what();
        return false;
    }
    document.is_missing = false;
    if (text == document.foreign) return false;
    const bool is_known = text == document.written || text == document.text;
    std::optional<model::Model> model;
    try {
        formats::Files texts{{document.file, text}};
        if (!is_known) model = formats::read_yaml(document.file, texts);
    } catch (const std::exception& error) {
        document.failure = error.what();
        document.foreign = std::move(text);
        return false;
    }
    document.failure.clear();
    document.foreign.reset();
    const bool is_waiting = document.text != document.written;
    document.written = text;
    if (text == document.text) document.waiting.clear();
    if (!model) return false;
    const auto waiting = std::exchange(document.waiting, {});
    take(document, std::move(*model), text);
    if (is_waiting) repeat(document, waiting);
    return true;
}

/// Edits that the file did not have yet when another program wrote it.
void Project::repeat(Document& document, const std::vector<std::optional<model::Operation>>& edits) {
    const auto tell = [&](const std::string& why) {
        if (collision_.empty())
            collision_ = "another program wrote " + document.file.string() + " at the same time, and " + why +
                         "; undo leads back to it";
    };
    for (const auto& edit : edits) try {
            if (edit)
                apply(document, *edit);
            else
                tell("what was undone, typed as a text or named in another file meanwhile is not in it");
        } catch (const model::Errors& error) {
            tell("an edit does not fit what is there now: " + std::string(error.what()));
        }
}

std::shared_ptr<const model::Model> Project::as_read() const {
    std::map<const Document*, std::shared_ptr<const model::Model>> known;
    const auto linked = [&](const auto& self,
                            const Document& document) -> std::shared_ptr<const model::Model> {
        auto& found = known[&document];
        if (!found && !has_references(document.read->root)) found = document.read;
        if (found) return found;
        model::Model model = *document.read;
        each_reference(model.root, [&](model::Reference& reference) {
            const fs::path file = (document.file.parent_path() / reference.file).lexically_normal();
            if (const Document* const other = find(file)) reference.model = self(self, *other);
        });
        return found = std::make_shared<const model::Model>(std::move(model));
    };
    return linked(linked, *documents_.front());
}

std::map<fs::path, std::string> Project::texts() const {
    std::map<fs::path, std::string> all;
    for (const auto& document : documents_) all[document->file] = document->text;
    return all;
}

std::string Project::text_in(const fs::path& file) const {
    const Document* const found = find(file);
    return found ? found->foreign.value_or(found->text) : "";
}

std::string Project::failure() const {
    for (const auto& document : documents_)
        if (!document->failure.empty()) return document->failure;
    return "";
}

} // namespace bf::service
