#include "bf/boundary/hosted_block.hpp"

#include "bf/boundary/positional.hpp"
#include "bf/core/kept_text.hpp"
#include "data_type.hpp"
#include "legacy_description.hpp"

#include <algorithm>
#include <cstring>
#include <elf.h>
#include <fstream>

namespace bf::boundary {

namespace core = blockfactory::core;

LegacyClass::LegacyClass(const std::string& file, std::string in_library, std::string its_name)
    : LegacyClass(std::make_shared<const Factory>(file.c_str(), its_name.c_str()), std::move(in_library),
                  its_name) {}
LegacyClass::LegacyClass(std::shared_ptr<const Factory> factory, std::string in_library, std::string its_name)
    : library(std::move(in_library)), name(std::move(its_name)), factory_(std::move(factory)) {
    if (!factory_->isValid())
        throw PluginError("plugin '" + library + "', block '" + name + "': " + factory_->getError());
}

std::string LegacyClass::locate(const char* call, const std::string& reason) const {
    return "plugin '" + library + "', block '" + name + "', " + call + ": " + reason;
}

LegacyObject::LegacyObject(std::shared_ptr<const LegacyClass> legacy, const Arguments& arguments)
    : information(legacy->library, legacy->name, arguments), legacy_(std::move(legacy)) {
    try {
        LogCapture log;
        block_ = legacy_->factory().create();
    } catch (const std::exception& error) {
        fail("constructor", std::string("threw an exception: ") + error.what());
    } catch (...) {
        fail("constructor", "threw an exception of unknown type");
    }
}

LegacyObject::~LegacyObject() {
    call("destructor", [this](core::Block& block, HostInformation&) {
        legacy_->factory().destroy(&block);
        return true;
    });
}

void LegacyObject::fail(const char* what, const std::string& reason) {
    keep_text(message_, legacy_->locate(what, reason));
}

void LegacyObject::explain(const char* what, bool good, const std::string& thrown,
                           const std::string& logged) {
    if (good)
        bfWarning << legacy_->locate(what, logged);
    else if (!thrown.empty())
        fail(what, thrown);
    else if (block_)
        fail(what, "returned false" + (logged.empty() ? " and logged no reason" : ": " + logged));
    else if (!message_[0])
        fail(what, "the plugin made no object");
}

namespace {

/// A default of the kind that the metadata asks for: zeros and empty texts.
Value default_value(const core::ParameterMetadata& metadata) {
    const bool is_scalar = metadata.rows == 1 && metadata.cols == 1;
    if (is_text(metadata.type)) return is_scalar ? Value("") : Value(std::vector<std::string>{});
    if (static_cast<int>(metadata.type) % 4 == 1 && is_scalar) return Value(false);
    return is_scalar ? Value(0.0) : Value(Matrix(Matrix::Zero(1, std::max(1, metadata.cols))));
}

constexpr const char* stem[] = {"u", "y"};

} // namespace

HostedBlock::HostedBlock(std::shared_ptr<const LegacyClass> legacy, const Arguments& arguments)
    : Block(arguments), legacy_(std::move(legacy)),
      given_(arguments), object_{this, [this] { return std::make_shared<LegacyObject>(legacy_, given_); }} {
    declare(arguments);
}

void HostedBlock::declare(const Arguments& arguments) {
    const LegacyDescription told(legacy_, arguments);
    for (const auto& metadata : told.parameters) {
        if (metadata.index < core::Block::NumberOfParameters) continue;
        parameters_.push_back(metadata);
        detail::declared_by(*this).arguments.push_back({argument_name(metadata.name),
                                                        "parameter " + std::to_string(metadata.index),
                                                        default_value(metadata)});
    }
    if (!told.problem.empty()) problem(told.problem);
    for (const auto& port : told.inputs)
        declare_port(false, port.index, port.dimension, native(port.dataType));
    for (const auto& port : told.outputs)
        declare_port(true, port.index, port.dimension, native(port.dataType));
}

void HostedBlock::declare_port(bool is_output, std::size_t index, const std::vector<int>& dimension,
                               Type type) {
    const std::string name = stem[is_output] + std::to_string(index + 1);
    bool is_open = false;
    const auto extent = [&](int length, const char* suffix) -> Extent {
        if (length != core::Port::DynamicSize) return length;
        is_open = true;
        return Dim(this, (name + suffix).c_str());
    };
    About about;
    if (dimension.size() == 1)
        about.shape = {extent(dimension[0], ".length")};
    else
        about.shape = {extent(dimension[0], ".rows"), extent(dimension[1], ".cols")};
    about.unit = any_unit;
    about.doc = is_output ? "output of the hosted block" : "input of the hosted block";
    with_type(type, [&](auto t) {
        using T = Array<typename decltype(t)::type>;
        const auto add = [&](auto key) {
            ports_.push_back({key.index(), is_output, is_open, [key](Now at) -> void* {
                                  return const_cast<typename decltype(t)::type*>(at[key].data());
                              }});
        };
        if (is_output)
            add(Output<T>(this, name, about));
        else
            add(Input<T>(this, name, about));
    });
}

void HostedBlock::infer(Inference& inference) const {
    const Size* common = nullptr;
    for (const auto& port : ports_)
        if (!port.is_output && port.is_open) {
            const Size* size = inference.size(port.slot);
            if (!size || (common && !(*common == *size))) return;
            common = size;
        }
    if (!common) return;
    const Size size = *common;
    for (const auto& port : ports_)
        if (port.is_output && port.is_open && !inference.size(port.slot)) {
            const auto& shape = resolution().slots[static_cast<std::size_t>(port.slot)].shape;
            if (shape.is_matrix == size.is_matrix) inference.set(port.slot, size);
        }
}

void HostedBlock::start(Now at) const {
    LegacyObject& object = at[object_];
    HostInformation::Ports sides[2];
    for (const auto& port : ports_) {
        const Slot& slot = resolution().slots[static_cast<std::size_t>(port.slot)];
        auto& side = sides[port.is_output];
        core::Port::Dimensions dimension{slot.size.rows};
        if (slot.shape.is_matrix) dimension.push_back(slot.size.cols);
        side.push_back({side.size(), dimension, legacy(slot.type)});
    }
    object.information.run_on(sides[0], sides[1]);
    std::size_t count[2] = {};
    for (const auto& port : ports_)
        object.information.point(port.is_output, count[port.is_output]++, port.memory(at));
    const bool good = object.call("initialize", [](core::Block& block, HostInformation& information) {
        return block.initialize(&information);
    }) && object.call("initializeInitialConditions", [](core::Block& block, HostInformation& information) {
        return block.initializeInitialConditions(&information);
    });
    if (!good) throw std::runtime_error(object.message());
    object.is_running = true;
}

Status HostedBlock::reset(Now at, After) const noexcept {
    LegacyObject& object = at[object_];
    // Before start there is nothing to reset; start sets the first conditions.
    if (!object.is_running ||
        object.call("initializeInitialConditions", [](core::Block& block, HostInformation& information) {
            return block.initializeInitialConditions(&information);
        }))
        return ok;
    return Status::failure(object.message());
}

Status HostedBlock::output(Now at, Out) const noexcept {
    LegacyObject& object = at[object_];
    if (!object.is_running) return Status::failure("the hosted block was not started");
    if (object.call("output", [](core::Block& block, HostInformation& information) {
            return block.output(&information);
        }))
        return ok;
    return Status::failure(object.message());
}

Status HostedBlock::update(Now at, Next) const noexcept {
    LegacyObject& object = at[object_];
    if (object.call("updateDiscreteState", [](core::Block& block, HostInformation& information) {
            return block.updateDiscreteState(&information);
        }))
        return ok;
    return Status::failure(object.message());
}

void HostedBlock::stop(Now at) const noexcept {
    LegacyObject& object = at[object_];
    if (!object.is_running) return;
    object.is_running = false;
    const bool good = object.call("terminate", [](core::Block& block, HostInformation& information) {
        return block.terminate(&information);
    });
    if (!good) bfWarning << object.message();
}

core::Parameters stored_parameters(const std::string& library, const std::string& name,
                                   const Arguments& values) {
    LogCapture log;
    const auto factory = core::ClassFactorySingleton::getInstance().getClassFactory({library, name});
    if (!factory) throw std::runtime_error(log.take());
    const LegacyDescription told(std::make_shared<const LegacyClass>(factory, library, name), values);
    if (!told.problem.empty()) throw std::runtime_error(told.problem);
    return told.values;
}

std::vector<std::string> legacy_labels(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    const auto read = [&](std::uint64_t offset, void* to, std::size_t size) {
        file.seekg(static_cast<std::streamoff>(offset));
        return bool(file.read(static_cast<char*>(to), static_cast<std::streamsize>(size)));
    };
    Elf64_Ehdr header;
    if (!read(0, &header, sizeof(header)) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0) return {};
    std::vector<Elf64_Shdr> sections(header.e_shnum);
    if (!read(header.e_shoff, sections.data(), sections.size() * sizeof(Elf64_Shdr))) return {};
    std::vector<std::string> labels;
    for (const auto& section : sections) {
        if (section.sh_type != SHT_DYNSYM || section.sh_link >= sections.size()) continue;
        std::vector<Elf64_Sym> symbols(section.sh_size / sizeof(Elf64_Sym));
        std::string names(sections[section.sh_link].sh_size, '\0');
        if (!read(section.sh_offset, symbols.data(), symbols.size() * sizeof(Elf64_Sym)) ||
            !read(sections[section.sh_link].sh_offset, names.data(), names.size()))
            return {};
        for (const auto& symbol : symbols) {
            constexpr std::string_view suffix = "_getBaseClassName";
            if (symbol.st_shndx == SHN_UNDEF || symbol.st_name >= names.size()) continue;
            const std::string_view name(names.data() + symbol.st_name);
            if (name.ends_with(suffix)) labels.emplace_back(name.substr(0, name.size() - suffix.size()));
        }
    }
    std::sort(labels.begin(), labels.end());
    return labels;
}

void add_legacy_classes(Library& library) {
    for (const auto& label : legacy_labels(library.file())) {
        const auto& listed = library.classes();
        if (std::any_of(listed.begin(), listed.end(), [&](const auto& c) { return c.name == label; }))
            continue;
        const auto factory =
            std::make_shared<const LegacyClass::Factory>(library.file().c_str(), label.c_str());
        if (factory->getStatus() == LegacyClass::Factory::Status::FactoryNotFound) continue; // not for us
        const auto legacy = std::make_shared<const LegacyClass>(factory, library.name(), label);
        library.group("hosted").add({library.name(), label, "hosted",
                                     "Hosted block " + legacy->factory().getClassName() + ".",
                                     [legacy](const Arguments& arguments) -> std::unique_ptr<Block> {
                                         return std::make_unique<HostedBlock>(legacy, arguments);
                                     },
                                     methods_of<HostedBlock>()});
    }
}

} // namespace bf::boundary

/// Symbol look-up in a plugin goes on in the libraries it was linked to. A plugin of the old kind has no
/// entry of its own and is linked to this library, so the registry finds this one.
extern "C" __attribute__((visibility("default"))) void bf_plugin_v1(bf::Library& library) {
    bf::boundary::add_legacy_classes(library);
    if (library.classes().empty())
        throw bf::PluginError("plugin " + library.file().string() +
                              " exports no block: it needs bf_plugin_v1 or SHLIBPP_DEFINE_SHARED_SUBCLASS");
}
