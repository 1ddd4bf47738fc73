// Colour tables as 33 anchors each, evenly spaced; between them colours are linear (wrong by at most 6 of
// 255, mostly 2). viridis, cividis, magma: matplotlib. vik: Crameri, Scientific colour maps.

import type { Colours } from '../api';

const ANCHORS: Record<Colours, string> = {
  viridis:
    '440154470d6048186a482374472d7b4536814240863f49893b528b375a8d33638d2f6a8e2c728e297a8e26818e23898e21908c' +
    '1f988b1f9f8821a68528ae8031b57b3ebc744cc26c5dc9636ece5882d34c96d83fabdc32c0df24d5e21aeae51afde725',
  cividis:
    '00224e00285b002e6a0433711a386f273e6e32436d3b496c434e6c4b546c52596d5a5f6e61656f686a716f70737576767c7b78' +
    '788481798b8778938d789b9376a39a75aba072b3a670bbad6cc3b469ccba64d4c15fddc958e6d051efd748f8df3cfee838',
  magma:
    '0000040303110a0822130d331d114628115a36106a430f7650127c5d177f691c817621818226818f2a819c2e7fa9327db63779' +
    'c33b75cf4170db486ae65163ee5c5ef5695cf9785dfb8761fd9668fea571feb47bfec387fed194fde0a2fceeb0fcfdbf',
  vik:
    '001261021f69022b710237790344810450890c5e921b6d9b2f7ca6478db1609dbc79adc792bdd2acccdcc5dbe5dce5e9ece5e1' +
    'eedacfe9cbb9e2bba4dcab8fd59c7bcf8e68c97f55c37243bc6331b3531fa5400e932e06832106741506660a07590008',
  grey: '000000ffffff',
  mask: '5b6672ffffff',
};

export const COLOUR_NAMES: Record<Colours, string> = {
  viridis: 'viridis',
  cividis: 'cividis',
  magma: 'magma',
  grey: 'grey',
  vik: 'vik (about zero)',
  mask: 'codes',
};

/** Colour tables that a person can choose for a map. */
export const CHOICES: Colours[] = ['viridis', 'cividis', 'magma', 'grey', 'vik'];

/** The table as 256 RGBA colours. */
export function colourTable(name: Colours): Uint8Array<ArrayBuffer> {
  const text = ANCHORS[name];
  const anchors = text.length / 6;
  const channel = (anchor: number, index: number): number =>
    parseInt(text.slice(anchor * 6 + index * 2, anchor * 6 + index * 2 + 2), 16);
  const table = new Uint8Array(256 * 4);
  for (let entry = 0; entry < 256; entry += 1) {
    const at = (entry / 255) * (anchors - 1);
    const before = Math.min(Math.floor(at), anchors - 2);
    for (let index = 0; index < 3; index += 1) {
      const low = channel(before, index);
      table[entry * 4 + index] = Math.round(low + (channel(before + 1, index) - low) * (at - before));
    }
    table[entry * 4 + 3] = 255;
  }
  return table;
}

/** A gradient for CSS, from the lowest to the highest value, towards `side`. */
export function cssGradient(name: Colours, side: string): string {
  const table = colourTable(name);
  const stops = Array.from({ length: 17 }, (_, stop) => {
    const entry = Math.round((stop / 16) * 255) * 4;
    return `rgb(${table[entry]} ${table[entry + 1]} ${table[entry + 2]})`;
  });
  return `linear-gradient(to ${side}, ${stops.join(', ')})`;
}
