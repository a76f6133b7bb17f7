// SVG elements, and the parts that every picture of a person is made of. Colours come from style/patient-pictures.css.

const SVG = "http://www.w3.org/2000/svg";

export function draw(name, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** A picture: it says nothing to a screen reader, because words stand beside every one of them. */
export function picture(width, height, ...children) {
  return draw("svg", { viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true", focusable: "false" }, ...children);
}

export function line(x1, y1, x2, y2, width, name) {
  return draw("line", { x1, y1, x2, y2, "stroke-width": width, class: name });
}

export function path(d, name) {
  return draw("path", { d, class: name });
}

export function disc(cx, cy, r, name) {
  return draw("circle", { cx, cy, r, class: name });
}

/** A person without the arm that matters, 200 x 240: from the front as in a mirror, from the side, from above. */
export const BODY = {
  front: () => [
    disc(100, 34, 20, "flesh"),
    line(89, 150, 86, 222, 19, "bone"),
    line(111, 150, 114, 222, 19, "bone"),
    path("M66 84 Q66 66 86 64 L114 64 Q134 66 134 84 L126 154 Q100 162 74 154 Z", "flesh"),
    line(100, 52, 100, 66, 15, "bone"),
  ],
  farArm: () => [line(67, 80, 60, 122, 14, "bone"), line(60, 122, 60, 158, 12, "bone")],
  side: () => [
    disc(92, 34, 20, "flesh"),
    path("M110 30 L118 39 L109 42 Z", "flesh"),
    line(92, 52, 92, 70, 15, "bone"),
    line(91, 152, 91, 222, 21, "bone"),
    path("M74 84 Q74 66 92 66 Q111 66 112 86 L107 152 Q91 160 76 152 Z", "flesh"),
  ],
  above: () => [
    draw("ellipse", { cx: 92, cy: 140, rx: 56, ry: 22, class: "flesh" }),
    disc(92, 136, 23, "flesh edge"),
    path("M84 116 L92 104 L100 116 Z", "flesh"),
  ],
  none: () => [],
};

/** Where the arm begins, by kind of body. */
export const SHOULDER = { front: [133, 80], side: [93, 82], above: [146, 138], none: [34, 104] };
