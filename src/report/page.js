// SPDX-License-Identifier: MIT OR Apache-2.0
"use strict";
// Gives the pictures of the page a legend of buttons, values under the pointer, and zoom.
(() => {
  const NS = document.querySelector("svg")?.namespaceURI;
  const { figures, looks } = JSON.parse(document.getElementById("data").textContent);

  const make = (name, attributes, parent) => {
    const element = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    parent?.append(element);
    return element;
  };
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  // A number with five digits, with a minus sign and no exponent where it can be helped.
  const written = (value) => {
    const text = Math.abs(value) >= 1e6 || (value !== 0 && Math.abs(value) < 1e-4)
      ? value.toExponential(4) : String(Number(value.toPrecision(5)));
    return text.replace("-", "\u2212");
  };

  // Places of round numbers: as in the program that drew the picture.
  const ticks = ([low, high], most) => {
    const least = (high - low) / Math.max(1, most);
    const power = Math.floor(Math.log10(least));
    const step = [1, 2, 5, 10].map((digit) => digit * 10 ** power).find((s) => s >= least * (1 - 1e-9));
    const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const places = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) {
      places.push([k * step, (k * step).toFixed(decimals).replace("-", "\u2212")]);
    }
    return places;
  };

  class Panel {
    constructor(figure, number, data) {
      Object.assign(this, { figure, number, data });
      for (const line of [...data.series, ...data.bands]) line.x = data.xs[line.x];
      this.whole = { x: data.x.span, y: data.y.span };
      this.span = this.whole;
      const [left, top, right, bottom] = data.area;
      const clip = make("clipPath", { id: `${figure.id}-${number}` }, figure.svg);
      make("rect", { x: left, y: top - 1, width: right - left, height: bottom - top + 2 }, clip);
      this.lines = data.series.map((_, k) =>
        [...figure.svg.querySelectorAll(`[data-series="${number}.${k}"]`)]);
      this.areas = data.bands.map((_, k) => figure.svg.querySelector(`[data-band="${number}.${k}"]`));
      for (const shape of [...this.lines.flat(), ...this.areas]) {
        shape?.setAttribute("clip-path", `url(#${figure.id}-${number})`);
      }
      this.drawn = figure.svg.querySelectorAll(`[data-ticks="${number}"]`);
      this.own = make("g", {}, figure.svg);
      this.dots = make("g", {}, figure.svg);
    }
    get isWhole() { return this.span === this.whole; }
    place(x, y) {
      const [left, top, right, bottom] = this.data.area;
      const share = (v, [low, high]) => (v - low) / (high - low);
      return [left + (right - left) * share(x, this.span.x), bottom - (bottom - top) * share(y, this.span.y)];
    }
    values([px, py]) {
      const [left, top, right, bottom] = this.data.area;
      const at = (share, [low, high]) => low + share * (high - low);
      return [at((px - left) / (right - left), this.span.x), at((bottom - py) / (bottom - top), this.span.y)];
    }
    holds([px, py]) {
      const [left, top, right, bottom] = this.data.area;
      return px >= left && px <= right && py >= top && py <= bottom;
    }
    // Draws everything that depends on the span anew; the program's own drawing returns with the whole span.
    draw() {
      this.own.replaceChildren();
      this.drawn.forEach((shape) => shape.classList.toggle("is-hidden", !this.isWhole));
      this.data.series.forEach((series, k) => {
        const [line, ...markers] = this.lines[k];
        if (!line) return;
        for (const shape of this.lines[k]) shape.dataset.whole ??= shape.getAttribute("d");
        const isPoints = series.shown === 2;
        if (this.isWhole) {
          this.lines[k].forEach((shape) => shape.setAttribute("d", shape.dataset.whole));
        } else {
          line.setAttribute("d", isPoints ? this.markers(series, this.points(series)) : this.path(series.x, series.y));
          markers.forEach((shape) => shape.setAttribute("d", this.markers(series, this.along(series))));
        }
      });
      this.data.bands.forEach((band, k) => {
        const area = this.areas[k];
        if (!area) return;
        area.dataset.whole ??= area.getAttribute("d");
        const back = this.path([...band.x].reverse(), [...band.low].reverse()).replace("M", "L");
        area.setAttribute("d", this.isWhole ? area.dataset.whole : `${this.path(band.x, band.high)}${back}Z`);
      });
      if (!this.isWhole) this.axes();
    }
    path(x, y) {
      let isOpen = false;
      return x.map((value, i) => {
        if (value === null || y[i] === null) { isOpen = false; return ""; }
        const [px, py] = this.place(value, y[i]);
        const letter = isOpen ? "L" : "M";
        isOpen = true;
        return `${letter}${clamp(px, -1e5, 1e5).toFixed(1)} ${clamp(py, -1e5, 1e5).toFixed(1)}`;
      }).join("");
    }
    points(series) {
      return series.x.map((x, i) => this.place(x, series.y[i])).filter((p) => this.holds(p));
    }
    // Places of markers: at equal ways along the line.
    along(series) {
      const places = [];
      let way = 0, next = 90 * (0.3 + 0.125 * (series.look % 8)), last = null;
      series.x.forEach((x, i) => {
        const point = this.place(x, series.y[i]);
        if (last && this.holds(last) && this.holds(point)) {
          const length = Math.hypot(point[0] - last[0], point[1] - last[1]);
          while (length > 0 && next <= way + length) {
            const t = (next - way) / length;
            places.push([last[0] + t * (point[0] - last[0]), last[1] + t * (point[1] - last[1])]);
            next += 90;
          }
          way += length;
        }
        last = point;
      });
      return places;
    }
    markers(series, places) {
      const { outline, is_closed } = looks[series.look % looks.length].marker;
      return places.map(([px, py]) => outline.map((line) => line.map(([x, y], i) =>
        `${i ? "L" : "M"}${(px + x).toFixed(1)} ${(py + y).toFixed(1)}`).join("") + (is_closed ? "Z" : "")).join("")).join("");
    }
    axes() {
      const [left, top, right, bottom] = this.data.area;
      for (const [value, text] of ticks(this.span.y, (bottom - top) / 40)) {
        const [, y] = this.place(this.span.x[0], value);
        const line = make("path", { d: `M${left} ${y}H${right}`, class: "l-grid", fill: "none" }, this.own);
        this.figure.svg.prepend(line);
        this.grid = [...(this.grid ?? []), line];
        make("text", { x: left - 7, y: y + 4, "text-anchor": "end", "font-size": 12, class: "f-ink" }, this.own).textContent = text;
      }
      for (const [value, text] of ticks(this.span.x, (right - left) / 90)) {
        const [x] = this.place(value, this.span.y[0]);
        make("path", { d: `M${x} ${bottom}v4`, class: "l-ink", fill: "none" }, this.own);
        make("text", { x, y: bottom + 18, "text-anchor": "middle", "font-size": 12, class: "f-ink" }, this.own).textContent = text;
      }
    }
    zoom(span) {
      this.grid?.forEach((line) => line.remove());
      this.grid = [];
      this.span = span ?? this.whole;
      this.draw();
    }
    // Of each visible series the sample nearest to a place: by x on each way there or back, then by height. Of parts of
    // a sum their width.
    nearest([x, y], hidden) {
      const [px, py] = this.place(x, y);
      const parts = this.data.bands.flatMap((band, k) => {
        if (!band.is_stacked || hidden.has(band.name)) return [];
        const offs = band.x.map((bx) => Math.abs(this.place(bx, 0)[0] - px)), i = offs.indexOf(Math.min(...offs));
        const [low, high] = [band.low[i], band.high[i]];
        return [{ name: band.name, look: band.look, x: band.x[i], y: high - low, k: `b${k}`, at: this.place(band.x[i], high) }];
      }).reverse();
      const samples = this.data.series.flatMap((series, k) => {
        if (hidden.has(series.name)) return [];
        let best = null;
        series.x.forEach((sx, i) => {
          if (sx === null || series.y[i] === null) return;
          const [qx, qy] = this.place(sx, series.y[i]);
          const off = Math.abs(qx - px) + 0.02 * Math.abs(qy - py);
          if (!best || off < best.off) best = { off, name: series.name, look: series.look, x: sx, y: series.y[i], k, at: [qx, qy] };
        });
        return best && Math.abs(best.at[0] - px) < 12 ? [best] : [];
      });
      return [...samples, ...parts];
    }
  }

  class Figure {
    constructor(element, id, data) {
      this.element = element;
      this.id = `clip-${id}`;
      this.svg = element.querySelector("svg");
      this.hidden = new Set();
      this.svg.setAttribute("viewBox", `0 0 ${data.width} ${data.legend}`);
      this.svg.querySelectorAll("[data-legend]").forEach((shape) => shape.remove());
      this.panels = data.panels.map((panel, number) => new Panel(this, number, panel));
      this.values = document.createElement("div");
      this.values.className = "values";
      this.values.setAttribute("role", "status");
      element.append(this.values);
      this.addLegend(data);
      this.svg.setAttribute("tabindex", "0");
      this.svg.addEventListener("pointermove", (event) => this.move(this.at(event)));
      this.svg.addEventListener("pointerleave", () => this.leave());
      this.svg.addEventListener("pointerdown", (event) => this.start(event));
      this.svg.addEventListener("pointerup", (event) => this.end(event));
      this.svg.addEventListener("pointercancel", () => this.cancel());
      this.svg.addEventListener("dblclick", () => this.reset());
      this.svg.addEventListener("keydown", (event) => this.key(event));
      this.svg.addEventListener("blur", () => this.leave());
      window.addEventListener("beforeprint", () => this.reset());
    }
    addLegend(data) {
      const legend = document.createElement("div");
      legend.className = "legend";
      const entries = new Map();
      for (const panel of data.panels) {
        for (const entry of [...panel.series, ...panel.bands]) {
          if (entry.name && !entries.has(entry.name)) entries.set(entry.name, entry);
        }
      }
      for (const [name, entry] of entries) {
        const button = document.createElement("button");
        button.type = "button";
        button.setAttribute("aria-pressed", "true");
        button.append(this.sample(entry), document.createTextNode(name));
        button.addEventListener("click", () => this.toggle(name, button));
        legend.append(button);
      }
      this.element.querySelector(".picture").after(legend);
    }
    sample(entry) {
      const look = looks[entry.look % looks.length], colour = `s${entry.look % 8}`;
      const svg = make("svg", { viewBox: "0 0 34 14", "aria-hidden": "true" });
      if (!("shown" in entry)) {
        make("rect", { width: 34, height: 14, "fill-opacity": entry.is_stacked ? 0.6 : 0.22, class: `f-${colour}` }, svg);
        return svg;
      }
      if (entry.shown !== 2) {
        make("path", { d: "M0 7H34", "stroke-width": entry.shown === 1 ? 3 : 1.5, "stroke-dasharray": entry.shown === 3 ? "3 3" : look.dash.join(" ") || "none", class: `l-${colour}` }, svg);
      }
      if (entry.shown === 1 || entry.shown === 3) return svg;
      const { outline, is_closed } = look.marker;
      const d = outline.map((line) => line.map(([x, y], i) => `${i ? "L" : "M"}${17 + x} ${7 + y}`).join("") + (is_closed ? "Z" : "")).join("");
      make("path", { d, "stroke-width": 1.4, class: `l-${colour} ${is_closed ? `f-${colour}` : ""}`, ...(is_closed ? {} : { fill: "none" }) }, svg);
      return svg;
    }
    toggle(name, button) {
      const isHidden = !this.hidden.delete(name);
      if (isHidden) this.hidden.add(name);
      button.setAttribute("aria-pressed", String(!isHidden));
      for (const panel of this.panels) {
        panel.data.series.forEach((series, k) => series.name === name &&
          panel.lines[k].forEach((shape) => shape.classList.toggle("is-hidden", isHidden)));
        panel.data.bands.forEach((band, k) => band.name === name && panel.areas[k]?.classList.toggle("is-hidden", isHidden));
      }
      this.leave();
    }
    // Place of the pointer in the picture's own pixels.
    at(event) {
      const box = this.svg.getBoundingClientRect(), view = this.svg.viewBox.baseVal;
      return [(event.clientX - box.left) * view.width / box.width, (event.clientY - box.top) * view.height / box.height];
    }
    move(place) {
      if (this.from) return this.stretch(place);
      this.leave();
      const panel = this.panels.find((candidate) => candidate.holds(place));
      if (!panel) return;
      const found = panel.nearest(panel.values(place), this.hidden);
      if (!found.length) return;
      const { x, y } = panel.data, unit = (axis) => (axis.unit ? ` ${axis.unit}` : "");
      this.values.replaceChildren(...found.map((sample) => {
        const { name, look, k, at } = sample;
        make("circle", { cx: at[0], cy: at[1], r: 4, fill: "none", "stroke-width": 2, class: `l-s${look % 8}` }, panel.dots);
        const line = document.createElement("div");
        line.dataset.series = `${panel.number}.${k}`;
        line.textContent = `${name}: ${written(sample.y)}${unit(y)} at ${written(sample.x)}${unit(x)}`;
        return line;
      }));
      const box = this.svg.getBoundingClientRect(), own = this.element.getBoundingClientRect();
      const scale = box.width / this.svg.viewBox.baseVal.width;
      const left = box.left - own.left + place[0] * scale + 14, top = box.top - own.top + place[1] * scale + 10;
      const width = this.values.offsetWidth;
      this.values.style.left = `${left + width > own.width ? Math.max(0, left - width - 28) : left}px`;
      this.values.style.top = `${top}px`;
      this.cursor = { panel, place };
    }
    leave() {
      this.values.replaceChildren();
      this.panels.forEach((panel) => panel.dots.replaceChildren());
    }
    start(event) {
      const place = this.at(event);
      const panel = this.panels.find((candidate) => candidate.holds(place));
      if (!panel || event.button !== 0 || event.pointerType === "touch") return;
      this.from = { panel, place };
      this.svg.setPointerCapture(event.pointerId);
      this.frame = make("rect", { class: "selected", width: 0, height: 0 }, this.svg);
    }
    // The corners between which is dragged, within the axes.
    corners(place) {
      const [left, top, right, bottom] = this.from.panel.data.area;
      const [x, y] = [clamp(place[0], left, right), clamp(place[1], top, bottom)];
      const [fx, fy] = this.from.place;
      return [Math.min(x, fx), Math.min(y, fy), Math.max(x, fx), Math.max(y, fy)];
    }
    stretch(place) {
      const [left, top, right, bottom] = this.corners(place);
      for (const [key, value] of Object.entries({ x: left, y: top, width: right - left, height: bottom - top })) this.frame.setAttribute(key, value);
    }
    end(event) {
      if (!this.from) return;
      const { panel } = this.from;
      const [left, top, right, bottom] = this.corners(this.at(event));
      this.cancel();
      if (right - left < 6 || bottom - top < 6) return;
      const [x0, y1] = panel.values([left, top]), [x1, y0] = panel.values([right, bottom]);
      // Further in, the numbers at the axes would have more digits than there is room for.
      const isTooNear = (key, low, high) => high - low < (panel.whole[key][1] - panel.whole[key][0]) / 500;
      if (isTooNear("x", x0, x1) || isTooNear("y", y0, y1)) return;
      this.leave();
      panel.zoom({ x: [x0, x1], y: [y0, y1] });
    }
    cancel() {
      this.frame?.remove();
      this.from = null;
    }
    reset() {
      this.leave();
      this.panels.forEach((panel) => panel.isWhole || panel.zoom(null));
    }
    key(event) {
      if (event.key === "Escape") return this.reset();
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      const panel = this.cursor?.panel ?? this.panels[0], [left, top, right, bottom] = panel.data.area;
      const before = this.cursor?.place ?? [left, (top + bottom) / 2];
      this.cursor = { panel, place: [clamp(before[0] + step * (right - left) / 100, left, right), before[1]] };
      this.move(this.cursor.place);
    }
  }

  for (const element of document.querySelectorAll("figure[data-figure]")) {
    const id = element.dataset.figure, data = figures[id], [wide, narrow] = element.querySelectorAll(".view");
    const panels = data.panels.map((panel, k) => ({ ...structuredClone(panel), ...data.narrow.panels[k] }));
    new Figure(narrow, `${id}-narrow`, { ...data.narrow, panels });
    new Figure(wide, id, data);
  }
})();
