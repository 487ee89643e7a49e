#include "bf/fmi/description.hpp"

#include <gtest/gtest.h>

namespace bf::fmi::test {
namespace {

Description sample() {
    Description d{.name = "sample", .token = "{1}", .doc = "a <b> & \"c\"", .tool = "tool"};
    d.co_simulation =
        Interface{.identifier = "sample", .has_state = true, .takes_any_step = true, .internal_step = 0.01};
    d.stop = 2.5;
    d.step = 0.1;
    d.units = {{"m/s", {{0, 1, -1}, 0.5, -2}}, {"s", {{0, 0, 1}}}};
    d.variables.push_back({.name = "time", .unit = "s", .causality = Causality::independent});
    d.variables.push_back({.name = "u",
                           .unit = "m/s",
                           .doc = "an input",
                           .reference = 1,
                           .causality = Causality::input,
                           .dimensions = {2, 3},
                           .start = {1, -2.5, 3e300, 0, -0.0, 6}});
    d.variables.push_back({.name = "n",
                           .reference = 2,
                           .type = Type::int16,
                           .causality = Causality::parameter,
                           .variability = Variability::tunable,
                           .initial = Initial::exact,
                           .start = {7},
                           .minimum = -3,
                           .maximum = 9});
    d.variables.push_back({.name = "y",
                           .reference = 3,
                           .type = Type::boolean,
                           .causality = Causality::output,
                           .variability = Variability::discrete,
                           .initial = Initial::calculated});
    d.outputs.push_back({3, std::vector<int>{1}});
    d.initial_unknowns.push_back({3});
    return d;
}

void expect_same(const Description& a, const Description& b) {
    EXPECT_EQ(to_xml(a), to_xml(b));
    EXPECT_EQ(a.units.size(), b.units.size());
    ASSERT_EQ(a.variables.size(), b.variables.size());
    for (std::size_t i = 0; i < a.variables.size(); ++i) {
        const auto &v = a.variables[i], &w = b.variables[i];
        EXPECT_EQ(std::tie(v.name, v.unit, v.doc, v.reference, v.causality, v.variability, v.initial),
                  std::tie(w.name, w.unit, w.doc, w.reference, w.causality, w.variability, w.initial));
        EXPECT_EQ(std::tie(v.dimensions, v.start, v.minimum, v.maximum),
                  std::tie(w.dimensions, w.start, w.minimum, w.maximum));
    }
}

TEST(Descriptions, AreReadAsTheyWereWritten) {
    const Description d = sample();
    expect_same(read_description(to_xml(d), "x.fmu"), d);
    Description scalars = scalars_of(d);
    scalars.version = 2;
    expect_same(read_description(to_xml(scalars), "x.fmu"), scalars);
    EXPECT_EQ(scalars.variables[6].name, "u[2,3]");
    EXPECT_EQ(scalars.variables[6].start, std::vector<double>{6});
    EXPECT_EQ(scalars.variables[6].reference, 6u);
    EXPECT_EQ(*scalars.outputs[0].dependencies, (std::vector<int>{1, 2, 3, 4, 5, 6}));
}

TEST(Descriptions, WriteNamesThatAreNoIdentifiersInQuotes) {
    EXPECT_EQ(structured_name("controller.K"), "controller.K");
    EXPECT_EQ(structured_name("my block.2nd"), "'my block'.'2nd'");
    EXPECT_EQ(structured_name("a.\u00fc 1\u20ac\t\n"), "a.'{C3BC} 1{E282AC}{09}{0A}'");
    EXPECT_EQ(structured_name("\u00fc\u00e4"), "'{C3BC}{C3A4}'");
    EXPECT_EQ(structured_name("it's.a\\b"), "'it\\'s'.'a\\\\b'");
}

TEST(Descriptions, CountRowsAndColumnsOfWhatHasNoElements) {
    const auto size = [](const std::vector<int>& dimensions) {
        const Variable v{.name = "v", .dimensions = dimensions};
        return std::vector{v.rows(), v.cols(), v.count()};
    };
    EXPECT_EQ(size({}), (std::vector{1, 1, 1}));
    EXPECT_EQ(size({4}), (std::vector{4, 1, 4}));
    EXPECT_EQ(size({2, 3}), (std::vector{2, 3, 6}));
    EXPECT_EQ(size({2, 3, 2}), (std::vector{2, 6, 12}));
    EXPECT_EQ(size({0}), (std::vector{0, 1, 0}));
    EXPECT_EQ(size({0, 3}), (std::vector{0, 0, 0}));
    EXPECT_EQ(size({3, 0}), (std::vector{3, 0, 0}));
    // (1 2 3; 4 5 6) column by column is 1 4 2 5 3 6.
    std::vector<int> places;
    for (int i = 0; i < 6; ++i) places.push_back(column_by_column(i, 2, 3));
    EXPECT_EQ(places, (std::vector{0, 2, 4, 1, 3, 5}));
}

/// What is said of the sample's text with a part of it replaced.
std::string refusal(const std::string& part, const std::string& by, int version = 3) {
    Description d = version == 2 ? scalars_of(sample()) : sample();
    d.version = version;
    std::string xml = to_xml(d);
    const auto at = xml.find(part);
    EXPECT_NE(at, std::string::npos) << part;
    if (at != std::string::npos) xml.replace(at, part.size(), by);
    try {
        read_description(xml, "x.fmu");
    } catch (const FmuError& error) {
        return error.what();
    }
    return "none";
}

TEST(Descriptions, AreRefusedWithLineAndRule) {
    const std::string at = "x.fmu: modelDescription.xml:";
    EXPECT_EQ(refusal("</ModelVariables>", ""),
              at + "13: it is no well-formed XML: XML_ERROR_MISMATCHED_ELEMENT");
    EXPECT_EQ(refusal("fmiVersion=\"3.0\"", "fmiVersion=\"1.0\""),
              at + "2: it is of FMI version '1.0', but 2.0 and 3.0 are known; export it for one of these");
    EXPECT_EQ(refusal("modelIdentifier=\"sample\"", "modelIdentifier=\"../../bin/sh\""),
              at + "3: the modelIdentifier '../../bin/sh' is no C name (FMI 3.0, section 2.4)");
    EXPECT_EQ(refusal("name=\"n\"", "name=\"u\""),
              at + "16: two variables are called 'u' (FMI 3.0, section 2.4.7)");
    EXPECT_EQ(refusal("valueReference=\"2\"", "valueReference=\"1\""),
              at + "16: two variables have the reference 1 (FMI 3.0, section 2.4.7)");
    EXPECT_EQ(refusal("causality=\"input\"", "causality=\"inputs\""),
              at + "15: 'causality' is 'inputs', but must be one of: parameter, calculatedParameter, "
                   "structuralParameter, input, output, local, independent (FMI 3.0, section 2.4.7)");
    EXPECT_EQ(refusal("start=\"7\"", "start=\"7x\""), at + "16: 'start' is '7x', which is no number");
    EXPECT_EQ(refusal("start=\"1 -2.5", "start=\"1 1 -2.5"),
              at + "15: 'u' has 6 elements, but 7 start values (FMI 3.0, section 2.4.7)");
    EXPECT_EQ(refusal("<Dimension start=\"2\"/>", "<Dimension start=\"20000000\"/>"),
              at + "15: 'u' has a size of 2e+07, which cannot be");
    EXPECT_EQ(refusal("<Dimension start=\"2\"/>", "<Dimension start=\"5000000\"/>"),
              at + "15: 'u' has more elements than fit into memory");
    EXPECT_EQ(refusal("<Dimension start=\"2\"/>", "<Dimension start=\"1.5\"/>"),
              at + "15: 'u' has a size of 1.5, which cannot be");
    EXPECT_EQ(refusal("<Output valueReference=\"3\"", "<Output valueReference=\"9\""),
              at + "20: 'valueReference' is 9, which is no variable's reference (FMI 3.0, section 2.4.8)");
    EXPECT_EQ(refusal("<Unknown index=\"9\"", "<Unknown index=\"99\"", 2),
              at + "26: 'index' is 99, but there are 9 variables (FMI 2.0.4, section 2.2.8)");
    EXPECT_EQ(refusal("<Float64", "<Float16"), at + "14: there is no type of variables <Float16>");
}

TEST(Descriptions, KnowNoEntitiesAndNoEndlessDepth) {
    const std::string bomb = "<?xml version=\"1.0\"?><!DOCTYPE a [<!ENTITY b \"bb\"><!ENTITY c \"&b;&b;\">]>"
                             "<fmiModelDescription fmiVersion=\"3.0\" modelName=\"&c;\"/>";
    EXPECT_THROW(read_description(bomb, "x.fmu"), FmuError);
    std::string deep;
    for (int i = 0; i < 100000; ++i) deep += "<a>";
    EXPECT_THROW(read_description(deep, "x.fmu"), FmuError);
    EXPECT_THROW(read_description("", "x.fmu"), FmuError);
    // Whatever is cut off or changed: a message or a description.
    const std::string xml = to_xml(sample());
    for (std::size_t i = 0; i < xml.size(); ++i) {
        std::string changed = xml;
        changed[i] = static_cast<char>(changed[i] ^ 0x11);
        for (const auto& text : {xml.substr(0, i), changed}) {
            try {
                read_description(text, "x.fmu");
            } catch (const FmuError&) { // it says what is wrong
            }
        }
    }
}

} // namespace
} // namespace bf::fmi::test
