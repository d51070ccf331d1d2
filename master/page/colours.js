// Maps of colours: from a share (0 to 1) to a colour, each with even steps of lightness where its name does not say otherwise.

export const MAPS = {
  viridis: [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]],
  // The upper part of a black-body map: mesh lines stay visible on every colour of it.
  heat: [[120, 28, 60], [170, 40, 60], [212, 60, 50], [236, 96, 40], [248, 140, 48], [252, 184, 80], [254, 220, 128], [255, 244, 190]],
  'cool to warm': [[59, 76, 192], [98, 130, 234], [141, 176, 254], [184, 208, 249], [221, 221, 221], [245, 196, 173], [244, 154, 123], [222, 96, 77], [180, 4, 38]],
  grey: [[70, 70, 70], [245, 245, 245]],
};

/// Colours of parts, told apart without colour vision by their lightness as well.
export const PARTS = [[86, 146, 204], [230, 150, 60], [96, 176, 120], [196, 110, 170], [232, 214, 90], [120, 200, 220], [190, 120, 90], [150, 150, 160]];

/// 256 colours of a map, four bytes each.
export function ramp(name) {
  const table = MAPS[name] ?? MAPS.viridis, bytes = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; i++) {
    const at = i / 255 * (table.length - 1), low = Math.min(Math.floor(at), table.length - 2), part = at - low;
    for (let k = 0; k < 3; k++) bytes[4 * i + k] = table[low][k] * (1 - part) + table[low + 1][k] * part;
    bytes[4 * i + 3] = 255;
  }
  return bytes;
}
