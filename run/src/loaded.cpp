#include "bf/run/loaded.hpp"

#include "bf/base/library_file.hpp"
#include "bf/base/names.hpp"
#include "bf/kernels/limits.hpp"

#include <algorithm>
#include <cstdio>
#include <dlfcn.h>

namespace bf {

namespace {

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size());
        lines.push_back(text.substr(at, end - at));
        at = end + 1;
    }
    return lines;
}

} // namespace

LoadedRun::LoadedRun(const std::filesystem::path& library) {
    const std::string file = std::filesystem::absolute(library).string();
    if (const std::string wrong = why_not_loadable(file); !wrong.empty())
        throw RunError("the library " + file + " cannot be opened: " + wrong);
    handle_.reset(::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL), [](void* handle) {
        if (handle) ::dlclose(handle);
    });
    if (!handle_) throw RunError(std::string("the library cannot be opened: ") + ::dlerror());
    const auto function = reinterpret_cast<bf_run_v1_function>(::dlsym(handle_.get(), "bf_run_v1"));
    if (!function)
        throw RunError(file + " exports no bf_run_v1, so it holds no run; bf generate without --embedded and "
                              "--sizes=runtime writes projects whose library does");
    library_ = function();
    model_ = library_->create();
    if (!model_) throw RunError(file + ": there is no memory for the model");
    library_->on_event(
        model_,
        [](void* self) {
            auto& run = *static_cast<LoadedRun*>(self);
            run.shows_event_ = true;
            run.show();
            run.shows_event_ = false;
        },
        this);
    read_given();
}

LoadedRun::LoadedRun(const bf_run_library& library, bf_run_model& model)
    : library_(&library), model_(&model) {
    read_given();
}

LoadedRun::~LoadedRun() {
    stop();
    if (handle_) library_->destroy(model_);
}

void LoadedRun::read_given() {
    for (const auto& parameter : table(bf_run_parameters))
        given_.emplace_back(parameter.data, parameter.data + parameter.info.bytes());
}

void LoadedRun::show_event(Observer& observer) noexcept {
    shows_event_ = true;
    observer.observe(*this);
    shows_event_ = false;
}

std::vector<RunRate> LoadedRun::rates() const {
    std::vector<RunRate> all;
    for (int r = 0; r < library_->rate_count; ++r) {
        const auto& rate = library_->rates[r];
        all.push_back({rate.is_continuous ? 0 : rate.period, rate.is_continuous});
    }
    return all;
}

std::vector<RunPanel> LoadedRun::plots() const {
    std::vector<RunPanel> all;
    for (int i = 0; i < library_->plot_count; ++i)
        all.push_back({library_->plots[i].title, lines_of(library_->plots[i].signals)});
    return all;
}

std::vector<Quantity> LoadedRun::table(bf_run_table table) const {
    std::vector<Quantity> all;
    bf_run_quantity row;
    for (int i = 0; library_->quantity(model_, table, i, &row); ++i) {
        Quantity quantity{
            row.path, static_cast<Type>(row.type), {}, row.rate, static_cast<std::byte*>(row.data)};
        auto& info = quantity.info;
        info.type = element_type(quantity.type);
        info.rows = static_cast<std::uint32_t>(row.rows);
        info.cols = static_cast<std::uint32_t>(row.cols);
        info.is_matrix = row.is_matrix;
        info.unit = row.unit;
        info.doc = row.doc;
        info.period = library_->rates[row.rate].period;
        info.is_held = !library_->rates[row.rate].is_continuous;
        for (int n = 0; n < row.name_count; ++n)
            info.names.emplace_back(row.names[n].value, row.names[n].name);
        info.element_names = lines_of(row.elements);
        all.push_back(std::move(quantity));
    }
    return all;
}

std::vector<Quantity> LoadedRun::parameters() const {
    auto all = table(bf_run_parameters);
    for (std::size_t i = 0; i < all.size(); ++i) all[i].given = given_[i];
    return all;
}

void LoadedRun::start() {
    stop();
    is_started_ = true;
    if (library_->initialize(model_)) return;
    const std::string why = failure();
    stop();
    throw RunError(why);
}

Status LoadedRun::step() noexcept {
    constexpr Status failed = Status::failure("the generated code failed");
    if (!library_->output(model_)) return failed;
    show();
    return library_->update(model_) ? ok : failed;
}

void LoadedRun::stop() noexcept {
    if (is_started_) library_->terminate(model_);
    is_started_ = false;
}

std::string LoadedRun::failure() const {
    const char* const text = library_->failure(model_);
    if (!text) return {};
    const char* const block = library_->failed_block(model_);
    return block && *block ? std::string(block) + ": " + text : text;
}

std::vector<CheckResult> LoadedRun::checks() const {
    std::vector<CheckResult> all;
    for (const auto& check : table(bf_run_checks))
        all.push_back({check.path, check[0], check.type == Type::boolean});
    return all;
}

bool LoadedRun::is_hit(int rate) const {
    const auto& its = library_->rates[rate];
    if (shows_event_ && !its.is_triggered) return its.is_continuous;
    return rate != 0 && library_->is_hit(model_, rate);
}

ParameterChange LoadedRun::prepare(const std::vector<ParameterValue>& values) {
    auto known = table(bf_run_parameters);
    for (auto& variable : table(bf_run_variables)) known.push_back(std::move(variable));
    std::vector<std::string> names;
    for (const auto& parameter : known) names.push_back(parameter.path);
    for (const auto& [path, elements] : values) {
        const auto found = std::find(names.begin(), names.end(), path);
        if (found == names.end())
            throw RunError("there is no parameter '" + path + "'" + did_you_mean(path, names) +
                           "; parameters are called block.parameter");
        const auto count = known[static_cast<std::size_t>(found - names.begin())].info.elements();
        char wrong[256];
        if (kernels::is_wrong_count("parameter", path.c_str(), static_cast<int>(count),
                                    static_cast<int>(elements.size()), wrong, sizeof wrong))
            throw RunError(wrong);
    }
    ParameterChange change;
    change.values = values;
    for (const auto& [path, elements] : change.values)
        change.rows.push_back({path.c_str(), elements.data(), static_cast<int>(elements.size())});
    return change;
}

Status LoadedRun::apply(ParameterChange& change) noexcept {
    const char* const wrong =
        library_->set_parameters(model_, change.rows.data(), static_cast<int>(change.rows.size()));
    if (!wrong) return ok;
    std::snprintf(change.refusal, sizeof change.refusal, "%s", wrong);
    return Status::failure("the generated code refuses the values");
}

std::vector<ParameterValue> LoadedRun::variables() const {
    std::vector<ParameterValue> all;
    for (const auto& variable : table(bf_run_variables)) all.push_back({variable.path, variable.values()});
    return all;
}

std::vector<ParameterValue> LoadedRun::follow(const std::vector<ParameterValue>& asked) const {
    return asked;
}

std::vector<std::byte> LoadedRun::snapshot() const {
    if (library_->snapshot_size == 0)
        throw RunError(name() + ": it holds blocks that generated code makes through the factory, whose "
                                "state cannot be saved; save the interpreted model");
    if (library_->failure(model_))
        throw RunError(name() + ": a step failed, so there is no state to go on from");
    std::vector<std::byte> bytes(library_->snapshot_size);
    library_->save(model_, bytes.data());
    return bytes;
}

void LoadedRun::restore(const std::vector<std::byte>& snapshot) {
    if (snapshot.size() != library_->snapshot_size)
        throw RunError("the snapshot has " + std::to_string(snapshot.size()) +
                       " bytes, but this program's have " + std::to_string(library_->snapshot_size) +
                       "; it belongs to another model");
    library_->restore(model_, snapshot.data());
}

} // namespace bf
