// The files of a model.
#include "bf/formats/yaml.hpp"
#include "comments.hpp"
#include "printer.hpp"
#include "reader.hpp"

#include "bf/base/text_file.hpp"
#include "bf/model/check.hpp"

#include <algorithm>
#include <map>

namespace bf::formats {
namespace {

using namespace model;
using std::filesystem::path;

/// Reads the files of a model, each once, and collects what is wrong in them.
class Loader {
  public:
    explicit Loader(Files* files = nullptr, bool reads = true) : files_(files), reads_(reads) {}

    std::vector<Diagnostic> wrong;

    /// The model in a file that `where` refers to; null if it is unreadable or wrong.
    std::shared_ptr<Model> load(const path& file, const Location& where, const std::string& block);

    /// The model in `text`, which stands in `file`; incomplete if something is wrong.
    Model read(std::string_view text, const path& file);

  private:
    Files* files_;           // null: nobody asks for the texts
    bool reads_;             // files of the disk, where their texts are not given
    std::vector<path> open_; // from the first file to the one that is being read
    std::map<path, std::shared_ptr<Model>> done_;
};

/// Where git has left both versions of lines on which it could not decide.
std::vector<Diagnostic> conflicts_in(std::string_view text, const Source& source) {
    std::vector<Diagnostic> found;
    int line = 0;
    for (std::size_t begin = 0; begin < text.size();
         begin = std::min(text.find('\n', begin), text.size()) + 1) {
        ++line;
        if (text.substr(begin).starts_with("<<<<<<< "))
            found.push_back({source.at(line, 1), "",
                             "a conflict of a merge stands here, between '<<<<<<<', '=======' and '>>>>>>>'",
                             "keep the lines of one side, or of both, and remove these three"});
    }
    return found;
}

Model Loader::read(std::string_view text, const path& file) {
    const Source source(text, file.string());
    if (std::vector<Diagnostic> conflicts = conflicts_in(text, source); !conflicts.empty()) {
        wrong.insert(wrong.end(), conflicts.begin(), conflicts.end());
        return {};
    }
    std::vector<std::pair<std::size_t, std::size_t>> quoted;
    Reader reader(source, [&](const std::string& name, const Location& where, const std::string& block) {
        return load(file.parent_path() / name, where, block);
    });
    Model model;
    try {
        model = reader.read_model(parse(source, quoted));
    } catch (const Errors& errors) {
        wrong.insert(wrong.end(), errors.diagnostics().begin(), errors.diagnostics().end());
        return model;
    }
    for (Diagnostic& diagnostic : check(model)) reader.wrong.push_back(std::move(diagnostic));
    std::ranges::stable_sort(reader.wrong, {},
                             [](const Diagnostic& d) { return std::pair(d.where.line, d.where.column); });
    wrong.insert(wrong.end(), reader.wrong.begin(), reader.wrong.end());
    attach_comments(model, source, std::move(quoted), reader.values);
    model.source = std::make_shared<const std::string>(text);
    return model;
}

std::shared_ptr<Model> Loader::load(const path& file, const Location& where, const std::string& block) {
    auto refuse = [&](std::string message, std::string remedy) {
        wrong.push_back({where, block, std::move(message), std::move(remedy)});
        return nullptr;
    };
    std::error_code error;
    const path real = std::filesystem::weakly_canonical(file, error);
    std::error_code error_of_folder;
    const path key = std::filesystem::absolute(file, error_of_folder).lexically_normal();
    if (error_of_folder) return refuse("the current folder is not there any more", "change to another one");
    const bool is_given = files_ && files_->contains(key);
    if (!is_given && !reads_)
        return refuse("the text of '" + file.string() + "' is not given with the model", "");
    if (!is_given && error != std::errc::too_many_symbolic_link_levels &&
        !std::filesystem::exists(file, error))
        return refuse("there is no file '" + file.string() + "'",
                      "a path is relative to the file that names it");
    if (const auto begin = std::ranges::find(open_, real); begin != open_.end()) {
        std::string ring;
        for (auto link = begin; link != open_.end(); ++link) ring += link->filename().string() + " -> ";
        return refuse("the files refer to each other in a ring: " + ring + real.filename().string(),
                      "remove one of these references");
    }
    if (const auto known = done_.find(real); known != done_.end()) return known->second;
    std::string text;
    if (is_given) {
        text = files_->at(key);
    } else {
        if (const std::string wrong = bf::read_file(file.string(), text, 64u << 20); !wrong.empty())
            return refuse("cannot read '" + file.string() + "': " + wrong, "");
        if (files_) files_->emplace(key, text);
    }
    open_.push_back(real);
    const std::size_t wrong_before = wrong.size();
    std::shared_ptr<Model> model = std::make_shared<Model>(read(text, file));
    open_.pop_back();
    if (wrong.size() > wrong_before) model = nullptr;
    return done_[real] = model;
}

Model read_file(Loader loader, const path& file) {
    const std::shared_ptr<Model> model = loader.load(file, {}, "");
    if (!loader.wrong.empty()) throw Errors(std::move(loader.wrong));
    return std::move(*model);
}

} // namespace

model::Model read_yaml(const path& file) { return read_file(Loader(), file); }
model::Model read_yaml(const path& file, Files& files) { return read_file(Loader(&files), file); }
model::Model read_yaml_given(const path& file, Files files) { return read_file(Loader(&files, false), file); }

model::Model read_yaml_text(std::string_view text, const std::string& name) {
    Loader loader;
    Model model = loader.read(text, name);
    if (!loader.wrong.empty()) throw Errors(std::move(loader.wrong));
    return model;
}

std::optional<model::Model> read_alone(const Source& source, Node& root) {
    std::vector<std::pair<std::size_t, std::size_t>> quoted;
    Reader reader(source);
    try {
        root = parse(source, quoted);
    } catch (const Errors&) {
        return {};
    }
    Model model = reader.read_model(root);
    if (!reader.wrong.empty()) return {};
    return model;
}

std::vector<model::Variable> read_yaml_variables(std::string_view text, const std::string& name) {
    const Source source(text, name);
    std::vector<std::pair<std::size_t, std::size_t>> quoted;
    Reader reader(source);
    Node root = parse(source, quoted);
    if (root.is_null()) root.line = root.column = 1; // nothing stands nowhere
    auto variables = reader.read_variables(root, "");
    if (!reader.wrong.empty()) throw Errors(std::move(reader.wrong));
    return variables;
}

} // namespace bf::formats
