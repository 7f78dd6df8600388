#include "app/light_options.h"

#include <fmt/core.h>

#include "app/parse.h"

namespace freevoxel {

namespace {

constexpr float kAmbientWithLamps = 0.15f;
constexpr double kBrightest = 1000.0;

Light parseLight(std::string_view text, bool directional) {
  // X,Y,Z or X,Y,Z,R,G,B: the text is cut after the third number.
  size_t cut = std::string_view::npos;
  int commas = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == ',' && ++commas == 3) cut = i;
  }
  Light light;
  light.directional = directional;
  if (commas != 2 && commas != 5) throw UsageError(fmt::format("expected X,Y,Z or X,Y,Z,R,G,B, found '{}'", text));
  light.world = parseTriple(text.substr(0, cut));
  if (commas == 5) {
    const glm::dvec3 colour = parseTriple(text.substr(cut + 1));
    for (int channel = 0; channel < 3; ++channel) {
      if (!(colour[channel] >= 0.0 && colour[channel] <= kBrightest)) {
        throw UsageError(fmt::format("expected a colour of three numbers from 0 to {}, found '{}'", kBrightest, text));
      }
    }
    light.linear = glm::vec3(colour);
  }
  if (directional && light.world == glm::dvec3(0.0)) throw UsageError("a direction must not be 0,0,0");
  return light;
}

void addLamp(CLI::App& command, const std::string& name, LightOptions& options, bool directional,
             const std::string& description) {
  const auto read = [&options, name, directional](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      try {
        options.lights.push_back(parseLight(text, directional));
      } catch (const UsageError& error) {
        throw UsageError(name + ": " + error.what());
      }
    }
  };
  command.add_option_function<std::vector<std::string>>(name, read, description)
      ->type_name("X,Y,Z[,R,G,B]")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group("Light");
}

double parseAmbient(std::string_view text) {
  const double ambient = parseNumber(text);
  if (!(ambient >= 0.0 && ambient <= kBrightest)) {
    throw UsageError(fmt::format("expected 0 to {}, found '{}'", kBrightest, text));
  }
  return ambient;
}

}  // namespace

void addLightOptions(CLI::App& command, LightOptions& options) {
  addLamp(command, "--light", options, false,
          "a lamp at a point of world space, with its linear colour (default 1,1,1); may be given again");
  addLamp(command, "--light-direction", options, true,
          "a lamp far away in that direction, with its linear colour (default 1,1,1); may be given again");
  addParsed(command, "--ambient", options.ambient, "SHARE",
            fmt::format("light that reaches everything, 0 to {} (default 1 without lamps, else {})", kBrightest,
                        kAmbientWithLamps),
            parseAmbient)
      ->group("Light");
  addChoice<Shading>(command, "--shading", options.shading,
                     {{"none", Shading::none}, {"lambert", Shading::lambert}, {"phong", Shading::phong}},
                     "how lamps light surfaces")
      ->group("Light");
}

Lighting makeLighting(const LightOptions& options) {
  Lighting lighting;
  lighting.lights = options.lights;
  lighting.shading = options.shading;
  lighting.ambient = options.ambient ? float(*options.ambient) : options.lights.empty() ? 1.0f : kAmbientWithLamps;
  return lighting;
}

}  // namespace freevoxel
