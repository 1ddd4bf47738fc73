// The shader of the map. It looks up values, so a new range or colour table needs no new data.

export const VERTEX = `#version 300 es
void main() {
  // One triangle that covers the canvas.
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

export const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;

// Each layer has two textures: the tiles of the shown level, and few coarse ones for what is not here yet.
// The place of a texture: its first column and row (in its own values), and image px per value.
uniform sampler2D u_value, u_value_coarse, u_photo, u_photo_coarse, u_mask, u_mask_coarse, u_table;
uniform vec3 u_value_place, u_value_coarse_place, u_photo_place, u_photo_coarse_place;
uniform vec3 u_mask_place, u_mask_coarse_place;

uniform vec2 u_canvas;      // device px
uniform vec2 u_centre;      // image coordinates at the centre of the canvas
uniform vec2 u_image;       // columns and rows of the image
uniform float u_zoom;       // device px per image px
uniform float u_dot;        // device px per px of the page
uniform vec2 u_range;
uniform bool u_log, u_smooth, u_clip, u_hillshade, u_hatch, u_coded;
uniform float u_photo_share;
uniform vec2 u_photo_range;
uniform vec2 u_codes[7];    // grey level and pattern of each code

out vec4 colour;

const float NOT_LOADED = -2e38;
bool missing(float value) { return value < -1e38; }
bool unloaded(float value) { return value < -1e38 && value > -2.5e38; }

float look(sampler2D texture_, vec3 place, vec2 at) {
  ivec2 texel = ivec2(floor(at / place.z) - place.xy);
  ivec2 size = textureSize(texture_, 0);
  if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size))) return NOT_LOADED;
  return texelFetch(texture_, texel, 0).r;
}

float either(sampler2D fine, vec3 place, sampler2D coarse, vec3 coarse_place, vec2 at) {
  float value = look(fine, place, at);
  return unloaded(value) ? look(coarse, coarse_place, at) : value;
}

float value_at(vec2 at) {
  return either(u_value, u_value_place, u_value_coarse, u_value_coarse_place, at);
}

// Between four values; those without data are left out, so that holes neither grow nor shrink.
float smooth_at(vec2 at, float nearest) {
  float side = u_value_place.z;
  vec2 place = at / side - 0.5;
  vec2 part = fract(place);
  vec2 base = (floor(place) + 0.5) * side;
  float sum = 0.0;
  float weights = 0.0;
  for (int corner = 0; corner < 4; corner++) {
    vec2 offset = vec2(corner & 1, corner >> 1);
    vec2 share = mix(1.0 - part, part, offset);
    float value = value_at(base + offset * side);
    if (missing(value)) continue;
    sum += value * share.x * share.y;
    weights += share.x * share.y;
  }
  return weights > 0.01 ? sum / weights : nearest;
}

float position_of(float value) {
  if (u_log) return log(max(value, 1e-30) / u_range.x) / log(u_range.y / u_range.x);
  return (value - u_range.x) / (u_range.y - u_range.x);
}

// Light from the upper left. The slope is in parts of the range, so the relief shows whatever the unit.
float shade(vec2 at, float value) {
  float side = u_value_place.z;
  vec4 around = vec4(value_at(at - vec2(side, 0.0)), value_at(at + vec2(side, 0.0)),
                     value_at(at - vec2(0.0, side)), value_at(at + vec2(0.0, side)));
  if (missing(around.x)) around.x = value;
  if (missing(around.y)) around.y = value;
  if (missing(around.z)) around.z = value;
  if (missing(around.w)) around.w = value;
  vec2 slope = (around.yw - around.xz) / (2.0 * side) / (u_range.y - u_range.x) * 30.0;
  vec3 normal = normalize(vec3(-slope, 1.0));
  return clamp(dot(normal, normalize(vec3(-1.0, -1.0, 1.6))) / 0.75, 0.25, 1.25);
}

// 1 on the strokes of pattern number 1 to 5, else 0.
float pattern(int kind, vec2 s) {
  float period = 8.0 * u_dot;
  float stroke = 1.6 * u_dot;
  if (kind == 1) return step(mod(s.x + s.y, period), stroke);
  if (kind == 2) return step(mod(s.x - s.y, period), stroke);
  if (kind == 3) return step(length(mod(s, period) - period * 0.5), stroke);
  if (kind == 4) return step(mod(s.x, period), stroke);
  if (kind == 5) return max(step(mod(s.x + s.y, period), stroke), step(mod(s.x - s.y, period), stroke));
  return 0.0;
}

void main() {
  vec2 screen = vec2(gl_FragCoord.x, u_canvas.y - gl_FragCoord.y);
  vec2 at = (screen - u_canvas * 0.5) / u_zoom + u_centre;
  if (any(lessThan(at, vec2(0.0))) || any(greaterThanEqual(at, u_image))) {
    colour = vec4(0.0);
    return;
  }
  float value = value_at(at);
  float code = -1.0;
  if (u_hatch) code = either(u_mask, u_mask_place, u_mask_coarse, u_mask_coarse_place, at);
  vec3 shown;
  if (unloaded(value)) {
    shown = vec3(0.36, 0.39, 0.43);
  } else if (missing(value) && code > 0.5) {
    // The hatch below says why; with a checkerboard under it nobody could read it.
    shown = vec3(0.227, 0.259, 0.302);
  } else if (missing(value)) {
    vec2 square = floor(screen / (8.0 * u_dot));
    shown = mod(square.x + square.y, 2.0) < 0.5 ? vec3(0.290, 0.325, 0.369) : vec3(0.227, 0.259, 0.302);
  } else if (u_coded) {
    vec2 look_of = u_codes[clamp(int(value + 0.5), 0, 6)];
    shown = mix(vec3(look_of.x), vec3(0.0), pattern(int(look_of.y), screen));
  } else {
    if (u_smooth) value = smooth_at(at, value);
    float band = 6.0 * u_dot;
    if (u_clip && value < u_range.x) {
      shown = vec3(step(band * 0.5, mod(screen.y, band)));
    } else if (u_clip && value > u_range.y) {
      shown = vec3(step(band * 0.5, mod(screen.x + screen.y, band)));
    } else {
      int entry = int(clamp(position_of(value), 0.0, 1.0) * 255.0 + 0.5);
      shown = texelFetch(u_table, ivec2(entry, 0), 0).rgb;
      if (u_hillshade) shown *= shade(at, value);
    }
  }
  if (u_photo_share > 0.0) {
    float light = either(u_photo, u_photo_place, u_photo_coarse, u_photo_coarse_place, at);
    float grey = clamp((light - u_photo_range.x) / (u_photo_range.y - u_photo_range.x), 0.0, 1.0);
    if (!missing(light)) shown = mix(shown, vec3(grey), u_photo_share);
  }
  // Quiet: what has no answer is not what people look for.
  if (code > 0.5) shown = mix(shown, vec3(0.75), 0.3 * pattern(int(code + 0.5), screen));
  colour = vec4(shown, 1.0);
}`;
