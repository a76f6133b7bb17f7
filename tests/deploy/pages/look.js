// What an eye would find wrong with a page as it stands: a list of sentences, empty when nothing is.
(target) => {
  const faults = [];
  const touched = "button, a[href], input, select, textarea, [role=tab]";
  const name = (e) => `${e.tagName.toLowerCase()}${e.id ? "#" + e.id : ""} "${(e.textContent || e.getAttribute("aria-label") || "").trim().slice(0, 30)}"`;
  const hiddenFromEyes = (e) => e.closest(".unseen, .skip") !== null;
  const seen = (e) => e.checkVisibility({ visibilityProperty: true, opacityProperty: true }) && !hiddenFromEyes(e);
  const width = Math.min(innerWidth, screen.width); // a phone's window grows with what is too wide for it
  const wide = document.scrollingElement.scrollWidth;
  if (Math.max(wide, innerWidth) > screen.width + 1 || wide > width + 1) faults.push(`the page is ${wide} px wide on ${width}`);

  for (const e of document.querySelectorAll("body *")) {
    if (!seen(e) || e.closest("svg, select") || e.tagName === "CANVAS") continue;
    const text = [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
    const style = getComputedStyle(e);
    const scrolls = (v) => v === "auto" || v === "scroll";
    if (text && e.clientWidth && e.scrollWidth > e.clientWidth + 1) faults.push(`cut or out of its box: ${name(e)}`);
    if (scrolls(style.overflowX) && e.scrollWidth > e.clientWidth + 1) faults.push(`scrolls sideways: ${name(e)}`);
    if (style.overflowY === "hidden" && e.scrollHeight > e.clientHeight + 1) {
      const cut = [...e.querySelectorAll("*")].find((c) => seen(c) && c.textContent.trim() && !c.closest("svg") && c.getBoundingClientRect().bottom > e.getBoundingClientRect().bottom + 1);
      if (cut) faults.push(`cut off below: ${name(cut)}`);
    }
    const box = e.getBoundingClientRect();
    if (text && (box.left < -1 || box.right > width + 1)) faults.push(`beyond the edge: ${name(e)}`);
  }

  const all = [...document.querySelectorAll(touched)].filter((e) => seen(e) && e.getBoundingClientRect().width > 0);
  const box = (e) => (e.matches("input[type=radio], input[type=checkbox]") ? (e.closest("label") ?? e) : e);
  if (target) {
    for (const e of all) {
      const { width, height } = box(e).getBoundingClientRect();
      if (width < target - 0.5 || height < target - 0.5) faults.push(`${name(e)} is ${width.toFixed(0)} x ${height.toFixed(0)} px to be touched`);
    }
  }
  const back = [...document.querySelectorAll("body, body *")].filter((e) => e.scrollHeight > e.clientHeight).map((e) => [e, e.scrollTop]);
  const [x, y] = [scrollX, scrollY];
  for (const e of all) {
    const shown = box(e);
    shown.scrollIntoView({ block: "center", inline: "center", behavior: "instant" });
    const { left, top, width, height } = shown.getBoundingClientRect();
    const hit = document.elementFromPoint(left + width / 2, top + height / 2);
    if (!hit || !(shown.contains(hit) || hit.contains(shown))) faults.push(`${name(e)} lies under ${hit ? name(hit) : "nothing"}`);
  }
  scrollTo(x, y);
  for (const [e, at] of back) e.scrollTop = at;

  const floats = (e) => {
    for (let at = e; at; at = at.parentElement) if (["sticky", "fixed"].includes(getComputedStyle(at).position)) return true;
    return false;
  };
  const still = all.filter((e) => !floats(e)).map((e) => [e, box(e).getBoundingClientRect()]);
  still.forEach(([a, p], i) => {
    for (const [b, q] of still.slice(i + 1)) {
      if (box(a).contains(box(b)) || box(b).contains(box(a))) continue;
      const across = Math.min(p.right, q.right) - Math.max(p.left, q.left);
      const down = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
      const scroller = (e) => e.parentElement?.closest("main, footer, header, #panel, dialog");
      if (across > 1 && down > 1 && scroller(a) === scroller(b)) faults.push(`${name(a)} lies over ${name(b)}`);
    }
  });
  return faults;
}
