#include "bf/service/project.hpp"

#include "bf/base/files.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/check.hpp"
#include "bf/model/edit.hpp"

#include <algorithm>
#include <set>
#include <sys/stat.h>

namespace bf::service {

namespace fs = std::filesystem;

namespace {

/// What tells that a file was written, without reading it.
struct Stamp {
    timespec changed{};
    ::ino_t inode = 0;
    ::off_t size = -1;

    bool operator==(const Stamp& other) const {
        return changed.tv_sec == other.changed.tv_sec && changed.tv_nsec == other.changed.tv_nsec &&
               inode == other.inode && size == other.size;
    }
};

Stamp stamp_of(const fs::path& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return {};
    return {status.st_ctim, status.st_ino, status.st_size};
}

/// Is the file in that folder or below, wherever links lead?
bool is_inside(const fs::path& file, const fs::path& folder) {
    const std::string way =
        fs::weakly_canonical(file).lexically_relative(fs::weakly_canonical(folder)).generic_string();
    return !way.empty() && way != ".." && !way.starts_with("../");
}

template <class Visit> void each_reference(model::System& system, const Visit& visit) {
    for (auto& block : system.blocks) {
        if (block.reference) visit(*block.reference);
        if (block.system) each_reference(*block.system, visit);
    }
}

} // namespace

struct Project::Document {
    fs::path file;
    model::Model model;
    model::History history;
    std::string written; ///< text of the file as it is known here
    Stamp stamp;
    bool is_unwritten = false;
    bool is_foreign = false; ///< the file holds a text of another program that is no model
    std::string failure;
    std::shared_ptr<const model::Model> shared; ///< the model, for those that refer to it

    /// Puts the model into its file, where the file holds another text.
    void save() {
        try {
            const std::string text = formats::write_yaml(model);
            is_unwritten = text != written;
            if (is_unwritten) {
                OutputFile output(file);
                output.write(text);
                output.commit();
                written = text;
                is_unwritten = false;
            }
            failure.clear();
        } catch (const FileError& error) {
            failure = error.what();
        }
        stamp = stamp_of(file);
    }
};

Project::Project(const fs::path& file) {
    open(fs::absolute(file).lexically_normal());
    link_all();
}

Project::~Project() = default;

const fs::path& Project::file() const { return documents_.front()->file; }
const model::Model& Project::model() const { return documents_.front()->model; }

Project::Document& Project::open(const fs::path& file) {
    for (const auto& document : documents_)
        if (document->file == file) return *document;
    auto made = std::make_unique<Document>();
    made->file = file;
    made->stamp = stamp_of(file);
    formats::Files texts;
    made->model = formats::read_yaml(file, texts);
    made->written = texts.at(file);
    documents_.push_back(std::move(made));
    Document& document = *documents_.back();
    each_reference(document.model.root, [&](model::Reference& reference) {
        open((file.parent_path() / reference.file).lexically_normal());
    });
    return document;
}

/// Gives the document's references what the files hold now. Files refer to each other without circles, which
/// their reader refuses.
void Project::link(Document& document) {
    if (document.shared) return;
    each_reference(document.model.root, [&](model::Reference& reference) {
        Document& other = open((document.file.parent_path() / reference.file).lexically_normal());
        link(other);
        reference.model = other.shared;
    });
    document.shared = std::make_shared<const model::Model>(document.model);
}

void Project::link_all() {
    for (const auto& document : documents_) document->shared = nullptr;
    for (std::size_t i = 0; i < documents_.size(); ++i) link(*documents_[i]); // linking may open more
}

void Project::changed() {
    link_all();
    ++revision_;
}

/// Follows the path through files; afterwards it is the path in the document.
Project::Document& Project::document_of(std::string& path) const {
    Document* document = documents_.front().get();
    for (std::size_t dot = path.find('.'); dot != path.npos; dot = path.find('.', dot + 1)) {
        const model::Block* block = model::find(std::as_const(document->model), path.substr(0, dot));
        if (!block) break;
        if (!block->reference) continue;
        const fs::path file = (document->file.parent_path() / block->reference->file).lexically_normal();
        const auto found = std::find_if(documents_.begin(), documents_.end(),
                                        [&](const auto& other) { return other->file == file; });
        if (found == documents_.end()) break;
        document = found->get();
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
                                 std::is_same_v<T, model::operations::Patch>) {
                concern(*documents_.front(), ""); // signals are named from the opened model on
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

/// What another program wrote is never written over, also where it is no model.
void Project::require_own(const Document& document) {
    if (document.is_foreign)
        throw model::Errors({{{},
                              "",
                              "another program has written into the file: " + document.failure,
                              "mend the file first"}});
}

void Project::edit(const model::Operation& operation) {
    static_cast<void>(synchronise()); // an edit is of what is there
    Document* document = nullptr;
    const model::Operation local = localised(operation, document);
    if (!document) return; // an empty batch
    const auto* const extract = std::get_if<model::operations::Extract>(&local);
    const auto require_inside = [&](const fs::path& file) {
        if (!is_inside(file, documents_.front()->file.parent_path()))
            throw model::Errors(
                {{{},
                  "",
                  "the file '" + file.string() + "' lies outside of the folder of the opened model",
                  "open it by itself"}});
    };
    require_inside(document->file);
    require_own(*document);
    const auto beside = [&](const std::string& file) {
        return (document->file.parent_path() / file).lexically_normal();
    };
    if (extract) require_inside(beside(extract->file));
    if (extract && fs::exists(beside(extract->file)))
        throw model::Errors(
            {{{}, extract->path, "the file '" + extract->file + "' exists", "give another name"}});
    const auto wrong = [&] { // in the files that refer to this one
        std::vector<model::Diagnostic> all;
        for (const auto& other : documents_)
            if (other.get() != document)
                for (auto& d : model::check(other->model)) all.push_back(std::move(d));
        return all;
    };
    std::set<std::string> known;
    for (const auto& d : wrong()) known.insert(d.text());
    document->history.edit(document->model, local, [&](const std::string& file) {
        Document& other = open(beside(file));
        link(other);
        return other.shared;
    });
    if (extract) { // the content becomes a file of its own
        auto made = std::make_unique<Document>();
        made->file = beside(extract->file);
        made->model = *model::find(std::as_const(document->model), extract->path)->reference->model;
        made->save();
        documents_.push_back(std::move(made));
    }
    link_all();
    std::vector<model::Diagnostic> broken = wrong();
    std::erase_if(broken, [&](const model::Diagnostic& d) { return known.contains(d.text()); });
    if (!broken.empty()) {
        document->history.undo(document->model);
        link_all();
        throw model::Errors(std::move(broken));
    }
    done_.push_back(document);
    undone_.clear();
    changed();
    document->save();
}

bool Project::step(std::vector<Document*>& from, std::vector<Document*>& to,
                   bool (model::History::*move)(model::Model&)) {
    static_cast<void>(synchronise());
    if (from.empty()) return false;
    Document& document = *from.back();
    require_own(document);
    if (!(document.history.*move)(document.model)) return false;
    to.push_back(&document);
    from.pop_back();
    changed();
    document.save();
    return true;
}

bool Project::synchronise() {
    bool is_other = false;
    for (std::size_t i = 0; i < documents_.size(); ++i) {
        Document& document = *documents_[i];
        const std::string failure = document.failure;
        if (document.stamp == stamp_of(document.file)) {
            if (document.is_unwritten) document.save();
            is_other |= document.failure != failure;
            continue;
        }
        document.stamp = stamp_of(document.file);
        try {
            if (std::string text = read_text_file(document.file); text != document.written) {
                formats::Files texts{{document.file, std::move(text)}};
                model::Model model = formats::read_yaml(document.file, texts);
                document.history.replace(document.model, std::move(model));
                document.written = texts.at(document.file);
                document.is_unwritten = document.is_foreign = false;
                done_.push_back(&document);
                undone_.clear();
                is_other = true;
                changed();
            }
            document.failure.clear();
            document.is_foreign = false;
        } catch (const model::Errors& error) {
            document.failure = error.what();
            document.is_foreign = true;
        } catch (const std::exception& error) {
            document.failure = error.what();
        }
        is_other |= document.failure != failure;
    }
    return is_other;
}

std::string Project::failure() const {
    for (const auto& document : documents_)
        if (!document->failure.empty()) return document->failure;
    return "";
}

} // namespace bf::service
