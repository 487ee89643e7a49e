// Documents and elaborated models.
#include "model.hpp"

#include "bf/base/files.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"
#include "bf/view/draw.hpp"

#include <cmath>
#include <limits>

namespace bf::python {

namespace fs = std::filesystem;

namespace {

/// A document that is edited, with what undoes it.
struct Document {
    model::Model model;
    fs::path file; ///< that it stands for
    model::History history = {};

    /// Of the model in a file that a block refers to; as it is on the disk.
    model::ReadReference reader() const {
        return [folder = fs::absolute(file).parent_path()](const std::string& name) {
            return std::make_shared<const model::Model>(formats::read_yaml(folder / name));
        };
    }
};

model::Model empty_model(std::string name) {
    model::Model model;
    model.name = std::move(name);
    return model;
}

using Overrides = std::vector<std::pair<std::string, std::string>>;

using Blocks = std::vector<nb::object>; ///< classes in Python

std::shared_ptr<PythonModel> elaborated(fs::path file, formats::Files texts, const Overrides& changes,
                                        const Blocks& blocks) {
    auto registry = make_registry();
    if (!blocks.empty()) registry->add(library_of(blocks));
    const WithoutGil parallel;
    auto made = std::make_shared<PythonModel>();
    ModelSource source{fs::absolute(file).lexically_normal(), std::move(texts), changes};
    made->document = formats::read_yaml(file, source.texts);
    static_cast<ExaminedModel&>(made->examined) =
        examine(made->document, std::move(source), nullptr, std::move(registry));
    for (auto& diagnostic : made->examined.diagnostics)
        if (diagnostic.message.find("plugin 'python' was not found") != std::string::npos) {
            diagnostic.message =
                "the model has blocks that are written in Python, but their classes were not given";
            diagnostic.remedy = "give them: load(..., blocks=[CLASS, ...])";
        }
    return made;
}

/// Of a document the texts of all files that it refers to, so that what was edited there counts.
std::shared_ptr<PythonModel> elaborated(const Document& document, const Overrides& changes,
                                        const Blocks& blocks) {
    const fs::path file = fs::absolute(document.file).lexically_normal();
    return elaborated(file, {{file, formats::write_yaml(document.model)}}, changes, blocks);
}

std::string drawn(const model::Model& model, const Diagram& diagram,
                  const std::vector<model::Diagnostic>& diagnostics, const std::string& system,
                  const std::vector<std::string>& show, bool dark) {
    editor::DrawOptions options;
    for (const auto& what : show) {
        options.sizes |= what == "sizes";
        options.types |= what == "types";
        options.rates |= what == "rates";
        options.units |= what == "units";
    }
    return editor::to_svg(editor::draw(model, system, diagram, diagnostics, options), dark);
}

PythonQuantity quantity_of(const Diagram& diagram, const std::string& path, const Node::End& end) {
    const Slot& slot = diagram.slot(end);
    PythonQuantity quantity{path, channel_info(diagram, end), slot.size_known, slot.type_known, {}, {}};
    if (slot.role == Role::parameter) {
        quantity.limits = slot.limits;
        if (slot.at_least >= 0) quantity.at_least = diagram.end_path({end.node, slot.at_least});
    }
    return quantity;
}

std::vector<PythonQuantity> quantities_of(const Diagram& diagram, const std::vector<SignalName>& names) {
    std::vector<PythonQuantity> all;
    for (const auto& name : names) {
        all.push_back(quantity_of(diagram, name.path, name.end));
        if (!name.unit.empty()) all.back().info.unit = name.unit;
        if (!name.doc.empty()) all.back().info.doc = name.doc;
    }
    return all;
}

std::vector<PythonQuantity> parameters_of(const Diagram& diagram) {
    std::vector<PythonQuantity> all;
    for (int n = 0; n < static_cast<int>(diagram.nodes.size()); ++n) {
        const auto& slots = diagram.nodes[static_cast<std::size_t>(n)].block->resolution().slots;
        for (int i = 0; i < static_cast<int>(slots.size()); ++i)
            if (const Node::End end{n, i}; slots[static_cast<std::size_t>(i)].role == Role::parameter)
                all.push_back(quantity_of(diagram, diagram.end_path(end), end));
    }
    return all;
}

/// A block of an elaborated model, which it keeps alive.
struct PythonBlock {
    std::shared_ptr<const PythonModel> model;
    int number;

    const Diagram& diagram() const { return model->examined.diagram; }
    const DiagramNode& node() const { return diagram().nodes[static_cast<std::size_t>(number)]; }
    std::map<std::string, PythonQuantity> quantities(Role role) const {
        std::map<std::string, PythonQuantity> all;
        const auto& slots = node().block->resolution().slots;
        for (int i = 0; i < static_cast<int>(slots.size()); ++i)
            if (const Node::End end{number, i}; slots[static_cast<std::size_t>(i)].role == role)
                all.emplace(slots[static_cast<std::size_t>(i)].name,
                            quantity_of(diagram(), diagram().end_path(end), end));
        return all;
    }
};

nb::object object_of(const Value& value) {
    switch (value.kind) {
    case Value::Kind::text: return nb::cast(value.text);
    case Value::Kind::texts: return nb::cast(value.texts);
    case Value::Kind::number: break;
    }
    if (value.rows == 1 && value.cols == 1) {
        if (value.type == Type::boolean) return nb::cast(value.data[0] != 0);
        if (const double x = value.data[0]; x == std::floor(x) && std::abs(x) < 0x1p53)
            return nb::cast(static_cast<std::int64_t>(x));
        return nb::cast(value.data[0]);
    }
    nb::list rows;
    for (int r = 0; r < value.rows; ++r) {
        nb::list row;
        for (int c = 0; c < value.cols; ++c)
            row.append(value.data[static_cast<std::size_t>(c * value.rows + r)]);
        rows.append(row);
    }
    return value.rows == 1 ? nb::object(rows[0]) : nb::object(rows);
}

double limit(const PythonQuantity& q, double Limits::*member) {
    return q.limits ? (*q.limits).*member : member == &Limits::maximum ? Limits::infinity : -Limits::infinity;
}

void bind_quantities(nb::module_& m) {
    nb::class_<PythonQuantity>(
        m, "Signal", "What a model says of a signal, a parameter or a state: its shape, unit and meaning.")
        .def_ro("path", &PythonQuantity::path, "As recordings call it: 'controller.tau'.")
        .def_prop_ro(
            "shape",
            [](const PythonQuantity& q) -> nb::object {
                return q.size_known ? nb::object(shape_of(q.info)) : nb::none();
            },
            nb::sig("def shape(self) -> tuple[int, ...] | None"),
            "() of a scalar, (n,), or (rows, columns); None where a wrong model does not say.")
        .def_prop_ro(
            "dtype",
            [](const PythonQuantity& q) {
                return q.type_known ? std::optional<std::string>(dtype_of(q.info.type)) : std::nullopt;
            },
            "As numpy calls it: 'float64', 'bool'; None where a wrong model does not say.")
        .def_prop_ro(
            "unit", [](const PythonQuantity& q) { return q.info.unit; }, "'N.m', 'rad'; empty for none.")
        .def_prop_ro(
            "doc", [](const PythonQuantity& q) { return q.info.doc; }, "What it is, in a sentence.")
        .def_prop_ro(
            "period", [](const PythonQuantity& q) { return q.info.period; },
            "Between two samples [s]; 0: continuous or constant.")
        .def_prop_ro(
            "element_names", [](const PythonQuantity& q) { return q.info.element_names; },
            "Of a vector, such as joints; empty where its elements have no names.")
        .def_prop_ro(
            "value_names", [](const PythonQuantity& q) { return q.info.names; },
            "Names of values, as of an enumeration.")
        .def_prop_ro(
            "minimum", [](const PythonQuantity& q) { return limit(q, &Limits::minimum); },
            "Of every element of a parameter; -inf: any.")
        .def_prop_ro(
            "above", [](const PythonQuantity& q) { return limit(q, &Limits::above); },
            "Every element of a parameter is greater than this; -inf: any.")
        .def_prop_ro(
            "maximum", [](const PythonQuantity& q) { return limit(q, &Limits::maximum); },
            "Of every element of a parameter; inf: any.")
        .def_ro("at_least", &PythonQuantity::at_least,
                "Path of the parameter that no element of this one is below; empty: none.")
        .def("__repr__", [](const PythonQuantity& q) {
            std::string text = "<Signal " + q.path;
            if (q.type_known) text += std::string(" ") + dtype_of(q.info.type);
            if (q.size_known) text += nb::cast<std::string>(nb::str(shape_of(q.info)));
            return text + (q.info.unit.empty() ? "" : " [" + q.info.unit + "]") + ">";
        });
}

void bind_blocks(nb::module_& m) {
    const auto of_role = [](Role role) {
        return [role](const PythonBlock& b) { return b.quantities(role); };
    };
    nb::class_<PythonBlock>(m, "BlockInfo", "A block of an elaborated model.")
        .def_prop_ro(
            "path", [](const PythonBlock& b) { return b.node().path; }, "'controller.pd'")
        .def_prop_ro(
            "type", [](const PythonBlock& b) { return b.node().type; },
            "'Gain', 'WholeBodyToolbox/MassMatrix'")
        .def_prop_ro(
            "library", [](const PythonBlock& b) { return b.node().library; },
            "The plugin that has it; empty for a standard block.")
        .def_prop_ro(
            "doc", [](const PythonBlock& b) { return b.node().doc; }, "What the model says of it.")
        .def_prop_ro(
            "where", [](const PythonBlock& b) { return b.node().where.text(); }, "'file:line:column'")
        .def_prop_ro(
            "period",
            [](const PythonBlock& b) -> double {
                const int rate = b.node().rate;
                if (rate < 0) return std::numeric_limits<double>::quiet_NaN();
                const SampleRate& r = b.diagram().rates[static_cast<std::size_t>(rate)];
                return r.is_continuous ? 0 : r.is_constant ? Limits::infinity : b.diagram().period(rate);
            },
            "Between two hits [s]; 0: continuous, inf: constant, NaN: not known.")
        .def_prop_ro(
            "arguments",
            [](const PythonBlock& b) {
                nb::dict all;
                for (const auto& [name, value] : b.node().arguments) all[name.c_str()] = object_of(value);
                return all;
            },
            nb::sig("def arguments(self) -> dict[str, object]"), "The values that it was made with.")
        .def_prop_ro("inputs", of_role(Role::input), "By their names.")
        .def_prop_ro("outputs", of_role(Role::output), "By their names.")
        .def_prop_ro("parameters", of_role(Role::parameter), "By their names.")
        .def_prop_ro("discrete_states", of_role(Role::discrete_state), "By their names.")
        .def_prop_ro("continuous_states", of_role(Role::continuous_state), "By their names.")
        .def("__repr__",
             [](const PythonBlock& b) { return "<" + b.node().type + " " + b.node().path + ">"; });
}

void bind_documents(nb::module_& m) {
    nb::class_<Document>(m, "Model")
        .def(
            "__init__",
            [](Document* self, std::string name, const fs::path& file) {
                new (self) Document{empty_model(std::move(name)), file};
            },
            nb::arg("name"), nb::arg("file") = fs::path("model.yaml"))
        .def(
            "_read",
            [](Document& self, const fs::path& file) {
                self.model = formats::read_yaml(file);
                self.file = file;
            },
            nb::arg("file"))
        .def(
            "_parse",
            [](Document& self, const std::string& text, const fs::path& file) {
                formats::Files files{{fs::absolute(file).lexically_normal(), text}};
                self.model = formats::read_yaml(fs::absolute(file).lexically_normal(), files);
                self.file = file;
            },
            nb::arg("text"), nb::arg("file"))
        .def(
            "_copy",
            [](Document& self, const Document& other) {
                self.model = other.model;
                self.file = other.file;
            },
            nb::arg("other"))
        .def(
            "_edit",
            [](Document& self, const std::string& operation) {
                self.history.edit(self.model, model::operation_from_json(operation), self.reader());
            },
            nb::arg("operation"), "Does the operation of that text.")
        .def(
            "undo", [](Document& self) { return self.history.undo(self.model); },
            "Takes back the last edit; False where there is none.")
        .def(
            "redo", [](Document& self) { return self.history.redo(self.model); },
            "Does again what was taken back; False where there is none.")
        .def_prop_rw(
            "file", [](const Document& self) { return self.file; },
            [](Document& self, const fs::path& file) { self.file = file; },
            "That the model stands for: what it refers to is meant from there.")
        .def_prop_ro("name", [](const Document& self) { return self.model.name; })
        .def_prop_ro(
            "text", [](const Document& self) { return formats::write_yaml(self.model); },
            "As YAML; what did not change keeps its bytes.")
        .def(
            "_save",
            [](const Document& self, const fs::path& file) {
                OutputFile output(file);
                output.write(formats::write_yaml(self.model));
                output.commit();
            },
            nb::arg("file"))
        .def(
            "_blocks",
            [](const Document& self) {
                std::vector<std::pair<std::string, std::string>> all;
                model::walk(self.model, [&](const std::string& path, const model::Block& block) {
                    all.emplace_back(path, block.type);
                });
                return all;
            },
            "Paths and types, '' of subsystems, in the order of the document.")
        .def(
            "_settings",
            [](const Document& self, const std::string& path) {
                std::map<std::string, std::string> all;
                if (const model::Block* block = model::find(self.model, path))
                    for (const auto& setting : block->settings) all[setting.name] = setting.value.matlab();
                return all;
            },
            nb::arg("path"))
        .def(
            "__eq__", [](const Document& a, const Document& b) { return a.model == b.model; },
            nb::is_operator(), nb::sig("def __eq__(self, other: object, /) -> bool"))
        .def(
            "_draw",
            [](const Document& self, const std::string& system, const std::vector<std::string>& show,
               bool dark, const Blocks& blocks) {
                const auto made = elaborated(self, {}, blocks);
                return drawn(self.model, made->examined.diagram, made->examined.diagnostics, system, show,
                             dark);
            },
            nb::arg("system"), nb::arg("show"), nb::arg("dark"), nb::arg("blocks"));
}

} // namespace

void bind_model(nb::module_& m) {
    bind_quantities(m);
    bind_blocks(m);
    bind_documents(m);
    nb::class_<PythonModel>(m, "LoadedModel")
        .def_prop_ro("name", [](const PythonModel& self) { return self.examined.diagram.name; })
        .def_prop_ro(
            "file", [](const PythonModel& self) { return self.examined.source.file; }, "Of the model.")
        .def_prop_ro(
            "step", [](const PythonModel& self) { return self.examined.diagram.step; }, "Base period [s].")
        .def_prop_ro(
            "stop", [](const PythonModel& self) { return self.examined.diagram.stop; },
            "How long the model says that it runs [s]; inf where it does not say.")
        .def_prop_ro(
            "diagnostics", [](const PythonModel& self) { return self.examined.diagnostics; },
            "What is wrong; a model with any cannot be run.")
        .def_prop_ro(
            "files",
            [](const PythonModel& self) {
                std::map<std::string, std::string> texts;
                for (const auto& [file, text] : self.examined.source.texts) texts[file.string()] = text;
                return texts;
            },
            "Texts of the model and of all files that it refers to, by their paths.")
        .def_prop_ro(
            "overrides", [](const PythonModel& self) { return self.examined.source.overrides; },
            "Names and expressions that were changed.")
        .def_prop_ro(
            "plots",
            [](const PythonModel& self) {
                std::vector<std::pair<std::string, std::vector<std::string>>> panels;
                for (const auto& panel : self.examined.diagram.plots) {
                    panels.emplace_back(panel.title, std::vector<std::string>());
                    for (const auto& signal : panel.signals) panels.back().second.push_back(signal.path);
                }
                return panels;
            },
            "Titles of panels, and the signals that the model draws there.")
        .def(
            "_generate",
            [](const PythonModel& self, const fs::path& folder, bool c) {
                std::string in_python;
                for (const auto& node : self.examined.diagram.nodes)
                    if (node.library == "python")
                        in_python += (in_python.empty() ? "" : ", ") + node.path + " (" + node.type + ")";
                if (!in_python.empty())
                    throw codegen::GenerationError("blocks that are written in Python are not generated: " +
                                                   in_python + "; write them in C++, or of standard blocks");
                const WithoutGil parallel;
                codegen::Options options;
                if (c) options.language = codegen::Language::c;
                codegen::write(
                    codegen::generate(self.examined.diagram, generation_options(self.examined, options)),
                    folder);
            },
            nb::arg("folder"), nb::arg("c"))
        .def("_require_right",
             [](const PythonModel& self) {
                 if (!self.examined.diagnostics.empty()) throw model::Errors(self.examined.diagnostics);
             })
        .def("_blocks",
             [](const std::shared_ptr<PythonModel>& self) {
                 std::vector<PythonBlock> all;
                 for (int n = 0; n < static_cast<int>(self->examined.diagram.nodes.size()); ++n)
                     all.push_back({self, n});
                 return all;
             })
        .def("_signals",
             [](const PythonModel& self) {
                 return quantities_of(self.examined.diagram, self.examined.diagram.signals());
             })
        .def("_recorded",
             [](const PythonModel& self) {
                 return quantities_of(self.examined.diagram, self.examined.diagram.recorded());
             })
        .def("_inputs",
             [](const PythonModel& self) {
                 return quantities_of(self.examined.diagram, self.examined.diagram.inputs);
             })
        .def("_outputs",
             [](const PythonModel& self) {
                 return quantities_of(self.examined.diagram, self.examined.diagram.outputs);
             })
        .def("_parameters", [](const PythonModel& self) { return parameters_of(self.examined.diagram); })
        .def(
            "_draw",
            [](const PythonModel& self, const std::string& system, const std::vector<std::string>& show,
               bool dark) {
                return drawn(self.document, self.examined.diagram, self.examined.diagnostics, system, show,
                             dark);
            },
            nb::arg("system"), nb::arg("show"), nb::arg("dark"));

    m.def(
        "_operation",
        [](const std::string& text) { return model::to_json(model::operation_from_json(text)); },
        nb::arg("text"), "The operation of that text, as text again.");
    m.attr("_operations") = std::variant_size_v<model::Operation>;
    m.def(
        "_examine",
        [](const fs::path& file, const Overrides& changes, const Blocks& blocks) {
            return elaborated(file, {}, changes, blocks);
        },
        nb::arg("file"), nb::arg("changes"), nb::arg("blocks"));
    m.def(
        "_examine",
        [](const Document& document, const Overrides& changes, const Blocks& blocks) {
            return elaborated(document, changes, blocks);
        },
        nb::arg("document"), nb::arg("changes"), nb::arg("blocks"));
}

} // namespace bf::python
