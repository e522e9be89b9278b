#include "nephele/modeling/felt/detail/functions.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/noise/varying_noise.h"

namespace nephele::felt {

namespace {

NoiseOptions noiseOptions(const std::string& kind, double frequency, std::int64_t seed) {
  NoiseOptions options;
  options.kind = noiseKindOf(kind);
  options.frequency = finite("frequency", frequency);
  options.seed = seedOf(seed);
  return options;
}

FractalSumOptions fractalOptions(std::int64_t octaves, double frequency, double lacunarity, double roughness,
                                 std::int64_t seed) {
  FractalSumOptions options;
  options.octaves = inRange("octaves", octaves, 1, 32);
  options.frequency = finite("frequency", frequency);
  options.lacunarity = finite("lacunarity", lacunarity);
  options.roughness = finite("roughness", roughness);
  options.seed = seedOf(seed);
  return options;
}

}  // namespace

void addNoiseFunctions(Registry& r) {
  r.group("noises");
  r.add("scalarfield perlin(float frequency = 1, int seed = 0)",
        "Perlin noise of mean 0 and rms 1; bumps are about 1/frequency wide.",
        "scalarfield bumps = abs(perlin(frequency = 4, seed = 7));", [](double frequency, std::int64_t seed) {
          return perlin({.frequency = finite("frequency", frequency), .seed = seedOf(seed)});
        });
  r.add(
      "scalarfield noise(string kind = \"perlin\", float frequency = 1, int seed = 0)",
      "Noise of mean 0 and rms 1 of a kind: perlin, simplex, worley, worley_difference, value, gabor or fft.",
      "scalarfield cells = noise(\"worley\", frequency = 3);",
      [](const std::string& kind, double frequency, std::int64_t seed) {
        return noise(noiseOptions(kind, frequency, seed));
      });
  r.add("scalarfield noise(string kind, scalarfield frequency, int seed = 0)",
        "Noise whose frequency differs from place to place, at most 256 times.",
        "scalarfield finerAbove = noise(\"perlin\", clamp(2 + identity().y, 2, 4));",
        [](const std::string& kind, const ScalarField& frequency, std::int64_t seed) {
          return noiseOfFrequency(noiseOptions(kind, 1, seed), frequency);
        });
  r.add("scalarfield movingnoise(float time, string kind = \"perlin\", float frequency = 1, int seed = 0)",
        "Noise that changes with time, wholly after about one unit of it.",
        "scalarfield boiling = movingnoise(0.4, frequency = 3);",
        [](double time, const std::string& kind, double frequency, std::int64_t seed) {
          NoiseOptions options = noiseOptions(kind, frequency, seed);
          options.time = finite("time", time);
          return noise(options);
        });
  r.add(
      "scalarfield fractalsum(int octaves = 4, float frequency = 1, float lacunarity = 2, float roughness = "
      "0.5, int seed = 0, string kind = \"perlin\")",
      "Sum of noises, each `lacunarity` times as fine and `roughness` times as high as the one before, of "
      "rms 1.",
      "scalarfield rough = fractalsum(octaves = 5, frequency = 2);",
      [](std::int64_t octaves, double frequency, double lacunarity, double roughness, std::int64_t seed,
         const std::string& kind) {
        return fractalSum(noiseOptions(kind, 1, 0),
                          fractalOptions(octaves, frequency, lacunarity, roughness, seed));
      });
  r.add(
      "scalarfield fractalsum(scalarfield noise, int octaves = 4, float frequency = 1, float lacunarity = 2, "
      "float roughness = 0.5, int seed = 0)",
      "The same of any noise of frequency 1.",
      "scalarfield rough = fractalsum(noise(\"simplex\"), octaves = 3);",
      [](const ScalarField& noise, std::int64_t octaves, double frequency, double lacunarity,
         double roughness, std::int64_t seed) {
        return fractalSum(noise, fractalOptions(octaves, frequency, lacunarity, roughness, seed));
      });
  r.add("vectorfield vectornoise(string kind = \"perlin\", float frequency = 1, int seed = 0)",
        "Three independent noises.", "vectorfield wobble = identity() + 0.1 * vectornoise(frequency = 2);",
        [](const std::string& kind, double frequency, std::int64_t seed) {
          return vectorNoise(noiseOptions(kind, frequency, seed));
        });
  r.add("vectorfield curlnoise(string kind = \"perlin\", float frequency = 1, int seed = 0)",
        "A velocity without divergence, each component of rms 1.",
        "vectorfield velocity = curlnoise(frequency = 2);",
        [](const std::string& kind, double frequency, std::int64_t seed) {
          return curlNoise(noiseOptions(kind, frequency, seed));
        });
}

}  // namespace nephele::felt
