// Looks words up in the generator's index. Its own search starts a worker and fetches the index, and a browser
// refuses both to a page that is opened from a folder; a script it loads.
(function () {
  "use strict";
  var field = document.getElementById("query"), results = document.getElementById("results");
  var article = document.querySelector("main > article"), loading = false;

  function load(then) {
    if (window.pages) return then();
    if (loading) return;
    loading = true;
    var script = document.createElement("script");
    script.src = index;
    script.onload = then;
    document.head.appendChild(script);
  }

  function plain(text) {
    var box = document.createElement("textarea");
    box.innerHTML = text;
    return box.value;
  }

  // Every word must occur; a word in the title counts more, and most where it is the title.
  function score(entry, words) {
    var title = entry.title.toLowerCase(), text = entry.text.toLowerCase(), sum = 0;
    for (var i = 0; i < words.length; i++) {
      var times = text.split(words[i]).length - 1;
      var named = title === words[i] ? 100 : title.indexOf(words[i]) >= 0 ? 30 : 0;
      if (!times && !named) return 0;
      sum += named + Math.min(times, 10);
    }
    return sum * (entry.location.indexOf("decisions/") >= 0 ? 0.3 : 1);
  }

  function piece(text, word) {
    var at = Math.max(0, text.toLowerCase().indexOf(word) - 80), p = document.createElement("p");
    var shown = (at ? ".. " : "") + text.slice(at, at + 220).replace(/\s+/g, " ") + " ..";
    shown.split(new RegExp("(" + word.replace(/[.*+?^${}()|[\]\\]/g, "\\$&") + ")", "i")).forEach(
      function (part, i) {
        var node = document.createElement(i % 2 ? "mark" : "span");
        node.textContent = part;
        p.appendChild(node);
      });
    return p;
  }

  function show() {
    var words = field.value.toLowerCase().split(/\s+/).filter(function (w) { return w.length > 1; });
    results.hidden = !words.length;
    article.hidden = !results.hidden;
    if (results.hidden) return;
    var titles = {};
    window.pages.forEach(function (entry) {
      if (entry.location.indexOf("#") < 0) titles[entry.location] = entry.title;
    });
    var found = window.pages.map(function (entry) { return {entry: entry, score: score(entry, words)}; })
      .filter(function (f) { return f.score > 0; }).sort(function (a, b) { return b.score - a.score; });
    // The text of a page holds that of its sections: it is told where none of them has all words.
    found = found.filter(function (f) {
      return f.entry.location.indexOf("#") >= 0 ||
        !found.some(function (g) { return g.entry.location.indexOf(f.entry.location + "#") === 0; });
    });
    results.textContent = "";
    var head = document.createElement("h1");
    head.textContent = found.length ? found.length + " places" : "Nothing has all of these words";
    results.appendChild(head);
    found.slice(0, 40).forEach(function (f) {
      var place = document.createElement("article"), title = document.createElement("h3");
      var link = document.createElement("a");
      link.href = base + "/" + f.entry.location;
      var page = titles[f.entry.location.split("#")[0]];
      link.textContent = plain(f.entry.title) + (page === f.entry.title ? "" : " - " + plain(page));
      link.onclick = function () { field.value = ""; show(); };
      title.appendChild(link);
      place.appendChild(title);
      place.appendChild(piece(plain(f.entry.text), words[0]));
      results.appendChild(place);
    });
    window.scrollTo(0, 0);
  }

  field.addEventListener("input", function () { load(show); });
  var asked = new URLSearchParams(location.search).get("q");
  if (asked) {
    field.value = asked;
    load(show);
  }
})();
