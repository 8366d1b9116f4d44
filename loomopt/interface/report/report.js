"use strict";
// Moves what Python has computed: looks positions up by their number, and reads curves off where they are drawn.
(() => {
  const COILS = 9, SECONDS = 4;

  const spring = (x, y, u, v) => {
    const long = Math.hypot(u - x, v - y) || 1, nx = -(v - y) / long * 12, ny = (u - x) / long * 12;
    let path = `M${x} ${y}`;
    for (let k = 1; k < 2 * COILS; k++) {
      const share = k / (2 * COILS), side = k % 2 ? 1 : -1;
      path += `L${(x + share * (u - x) + side * nx).toFixed(1)} ${(y + share * (v - y) + side * ny).toFixed(1)}`;
    }
    return path + `L${u} ${v}`;
  };

  const set = (element, values) => {
    for (const name in values) element.setAttribute(name, values[name]);
  };

  // One machine of one layer at one pose; what a design of another stage has not is hidden.
  const place = (layer, poses, pose) => {
    const at = name => {
      const moving = poses.joints[name], points = moving || poses.fixed[name], k = moving ? 2 * pose : 0;
      return points ? [points[k] / 10, points[k + 1] / 10] : [NaN, NaN];
    };
    layer.querySelectorAll("[data-a],[data-at]").forEach(part => {
      const there = [part.dataset.a, part.dataset.b, part.dataset.at].every(n => !n || n in poses.joints || n in poses.fixed);
      part.style.display = there ? "" : "none";
    });
    const shown = kind => [...layer.querySelectorAll(kind)].filter(part => part.style.display !== "none");
    shown("line").forEach(line => {
      const [x1, y1] = at(line.dataset.a), [x2, y2] = at(line.dataset.b);
      set(line, {x1, y1, x2, y2});
    });
    shown("path.return-spring").forEach(path => {
      path.setAttribute("d", spring(...at(path.dataset.a), ...at(path.dataset.b)));
    });
    shown("circle").forEach(circle => {
      const [cx, cy] = at(circle.dataset.at);
      set(circle, {cx, cy});
      if (circle.dataset.ring) circle.setAttribute("r", poses.rings[circle.dataset.ring]);
    });
    shown("text").forEach(text => {
      const [x, y] = at(text.dataset.at);
      set(text, {x: x + 10, y: y - 10});
    });
    shown("path.ground").forEach(path => {
      const [x, y] = at(path.dataset.at);
      path.setAttribute("d", `M${x - 16} ${y + 22}L${x} ${y}L${x + 16} ${y + 22}Z`);
    });
    shown("g[data-turns]").forEach(piece => {
      const [x, y] = at(piece.dataset.at), k = piece.dataset.turns;
      piece.setAttribute("transform", `translate(${x} ${y}) rotate(${poses.turns[k][pose]})`);
      piece.querySelector("polygon").setAttribute("points", poses.pieces[k]);
    });
  };

  // What curves are at an angle, read off their own points; a curve that is not known there says nothing.
  const read = (svg, x) => {
    const [left, right, low, high, bottom, top, least, most] = svg.dataset.ends.split(" ").map(Number);
    const px = left + (x - low) / (high - low) * (right - left);
    svg.querySelector(".cursor").setAttribute("d", `M${px.toFixed(1)} ${top}V${bottom}`);
    const found = [];
    svg.querySelectorAll("polyline.curve:not(.today)").forEach(curve => {
      const points = curve.points;
      for (let k = 1; k < points.numberOfItems; k++) {
        const a = points.getItem(k - 1), b = points.getItem(k);
        if (a.x <= px && px <= b.x && b.x > a.x) {
          const y = a.y + (px - a.x) / (b.x - a.x) * (b.y - a.y);
          found.push(least + (bottom - y) / (bottom - top) * (most - least));
          break;
        }
      }
    });
    const size = Math.max(Math.abs(least), Math.abs(most)), digits = Math.max(0, 2 - Math.floor(Math.log10(size)));
    const told = y => (digits < 8 ? y.toFixed(digits) : y.toExponential(2)).replace(/^-(?=[0.]*$)/, "");
    return found.map(told).join(", ");
  };

  const start = machine => {
    const data = JSON.parse(machine.querySelector("script").textContent);
    const article = machine.closest("article") || document;
    const controls = machine.querySelector(".controls"), slider = controls.querySelector(".turn");
    const which = controls.querySelector(".which"), play = controls.querySelector(".play");
    const charts = [...article.querySelectorAll("svg[data-ends]")], count = +slider.max + 1;
    let timer = 0;
    const show = () => {
      const pose = +slider.value, stage = which ? +which.value : 0;
      for (const kind in data.poses) {
        const poses = data.poses[kind];
        place(machine.querySelector(`g.${kind}`), poses[Math.min(stage, poses.length - 1)], pose);
      }
      const angle = data.step ? data.step * pose : +data.angles[pose];
      controls.querySelector(".angle").textContent = `phi = ${angle} ${data.unit}`;
      if (which) which.nextElementSibling.textContent = data.told[stage] || stage + 1;
      charts.forEach(svg => {
        svg.closest("figure").querySelector(".told").textContent = read(svg, angle);
      });
    };
    const stop = () => {
      cancelAnimationFrame(timer);
      timer = 0;
      play.textContent = "\u25b6";
    };
    const go = () => {
      const begun = performance.now(), from = +slider.value;
      const step = now => {
        slider.value = (from + Math.floor((now - begun) / 1000 / SECONDS * count)) % count;
        show();
        timer = requestAnimationFrame(step);
      };
      play.textContent = "\u275a\u275a";
      timer = requestAnimationFrame(step);
    };
    play.addEventListener("click", () => timer ? stop() : go());
    slider.addEventListener("input", () => { stop(); show(); });
    if (which) which.addEventListener("input", show);
    machine.addEventListener("keydown", event => {
      const step = {ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10}[event.key];
      if (event.key === " " && event.target !== play) {
        event.preventDefault();
        play.click();
      } else if (step && event.target !== which) {
        event.preventDefault();
        stop();
        slider.value = (+slider.value + step + count) % count;
        show();
      }
    });
    controls.hidden = false;
    article.classList && article.classList.add("moving");
    show();
  };

  document.querySelectorAll(".machine").forEach(start);
})();
