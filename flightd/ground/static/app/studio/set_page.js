// One set: the picture in hand with what is marked in it, all its pictures, and what is learnt from them.
import { mayOperate } from "../access/session.js";
import { html } from "../html.js";
import { say } from "../language.js";
import { toneOf } from "../paints.js";
import { useTitle } from "../router.js";
import { AddPictures } from "./add_pictures.js";
import { LensCard } from "./lens_card.js";
import { PictureCard } from "./picture_card.js";
import { Profile } from "./profile_card.js";
import { ScoreCard } from "./score_card.js";
import { choosePicture, pictureHref, studio } from "./studio_state.js";

export function SetPage({ name }) {
  useTitle(name);
  const { set, trouble } = studio();
  if (!set) {
    return trouble ? html`<p><a href="/studio">${say("All sets")}</a></p>` : html`<p class="loading quiet" role="status">${say("Opening the set …")}</p>`;
  }
  const shows = set.pictures.filter(showsPaint).length;
  return html`
    <header class="studio-head">
      <p class="quiet"><a href="/studio">${say("Studio")}</a></p>
      <h2>${name} <small><i class="paint-swatch" style=${{ background: toneOf(set.paint) }} aria-hidden="true" />${say("{paint} paint", { paint: say(set.paint) })}</small></h2>
    </header>
    <div class="studio-grid">
      <div class="studio-main">
        <${PictureCard} />
        <section class="card strip" aria-labelledby="strip"><h3 id="strip">${say("Pictures")} <small>${say("{n} picture, paint marked in {shows}|{n} pictures, paint marked in {shows}", { n: set.pictures.length, shows })}</small></h3>
          <ul>${set.pictures.map((picture, i) => html`<${Thumb} key=${picture.file} picture=${picture} number=${i + 1} />`)}</ul>
          ${set.pictures.length === 0 && html`<p class="quiet">${say("Start here: take pictures of your floor from a flight, from the drone as it stands, or from files, under every light that the floor has.")}</p>`}
          ${mayOperate() ? html`<${AddPictures} />` : html`<p class="quiet">${say("Only looking on: an operator adds and marks pictures.")}</p>`}
        </section>
      </div>
      <div class="studio-side">
        <${ScoreCard} shows=${shows} />
        <${Profile} profile=${set.profile} />
        <${LensCard} />
      </div>
    </div>
  `;
}

export const showsPaint = (picture) => picture.regions.some((one) => one.paint) || picture.lines.length > 0;

function Thumb({ picture, number }) {
  const { regions, lines, negative } = picture;
  const marked = negative ? say("no line") : [regions.length && say("{n} mark|{n} marks", { n: regions.length }), lines.length && say("{n} line|{n} lines", { n: lines.length })].filter(Boolean).join(", ");
  return html`
    <li>
      <button class="thumb" aria-pressed=${picture.file === studio().chosen} onClick=${() => choosePicture(picture.file)}>
        <img src=${pictureHref(picture.file)} alt="" loading="lazy" width="128" height="72" />
        <span>${number}. ${marked || say("nothing marked")}</span>
      </button>
    </li>
  `;
}
